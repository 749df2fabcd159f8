// SPDX-License-Identifier: MIT
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include <antipode/distributions/pose_algebra.hpp>
#include <antipode/distributions/pose_fusion.hpp>
#include <antipode/distributions/pose_gaussian_queries.hpp>

#include "support/catch.hpp"
#include "support/error_message.hpp"
#include "support/random.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

using Pose = DualQuaternion<double>;
using Density = PoseGaussian<double>;

/// Standard deviations in the axes of a body, as seen by a frame `lever` away from it.
Matrix6<double> covariance(const Vector6<double>& sigma, const Vector3<double>& lever = {0, 0, 0}) {
  const Matrix6<double> A = Pose::from_rotation_translation(Vector4<double>(1, 0, 0, 0), lever).adjoint();
  return detail::congruence<double, 6, 6>(A, sigma.cwiseAbs2().asDiagonal());
}

/// An estimate of x whose error is a draw of its covariance.
Density estimate(Rng& rng, const Pose& x, const Matrix6<double>& P) {
  const Vector6<double> xi = sample(Density{Pose(), P}, rng).log();
  return {x * Pose::exp(-xi), P};
}

}  // namespace

TEST_CASE("Fused pairs are consistent for wide rotations and with long levers", "[fusion][random]") {
  constexpr int kPairs = 1000;
  for (const double sigma : {0.02, 0.3}) {
    for (const double lever : {0.0, 5.0}) {
      CAPTURE(sigma, lever);
      Rng rng(1);
      double sum = 0.0, distances = 0.0;
      for (int k = 0; k < kPairs; ++k) {
        const auto x = random_pose<double>(rng);
        Vector6<double> deviations;
        deviations << sigma, 0.5 * sigma, 0.8 * sigma, 0.5, 0.1, 0.3;
        const auto a = estimate(rng, x, covariance(deviations, lever * random_unit<double, 3>(rng)));
        const auto b =
            estimate(rng, x, covariance(deviations.reverse(), lever * random_unit<double, 3>(rng)));
        const auto fused = fuse(a, b);
        REQUIRE(fused.converged);
        sum += nees(fused.density, x) / kPairs;
        distances += fused.mahalanobis_squared / kPairs;
      }
      // Six standard deviations of a mean of chi-squares, 12 / 1000 each: 0.11. Gaussian to second order
      // only.
      CHECK(std::abs(sum - 6.0) <= 0.5);
      CHECK(std::abs(distances - 6.0) <= 0.5);
    }
  }
}

TEST_CASE("Fusing in single precision settles at its rounding", "[fusion][random]") {
  using Single = DualQuaternion<float>;
  for (const float scale : {1.0F, 100.0F, 1000.0F}) {
    CAPTURE(scale);
    Rng rng(8);
    Vector6<float> sigma;
    sigma << 0.01F, 0.01F, 0.01F, 0.05F, 0.05F, 0.05F;
    const PoseGaussian<float> noise{Single(), sigma.cwiseAbs2().asDiagonal()};
    for (int k = 0; k < 200; ++k) {
      const auto direction = random_pose<float>(rng);
      const auto x = Single::from_rotation_translation(direction.rotation(),
                                                       Vector3<float>(scale * direction.translation()));
      const PoseGaussian<float> a{x * sample(noise, rng), noise.covariance};
      const PoseGaussian<float> b{x * sample(noise, rng), noise.covariance};
      CHECK(fuse(a, a).converged);
      const auto fused = fuse(a, b);
      REQUIRE(fused.converged);
      CHECK(fused.iterations <= 12);
      CHECK(fused.density.covariance(0, 0) == Approx(0.5F * 1e-4F).epsilon(1e-2));
    }
    // A turn of .1 rad known together with a position to 1 cm: the rounding of the position turns it.
    Vector6<float> wide;
    wide << 0.1F, 0.1F, 0.1F, 0.01F, 0.01F, 0.01F;
    const auto lever = Single::from_rotation_translation(Vector4<float>(1, 0, 0, 0), Vector3<float>(1, 2, 3));
    const Matrix6<float> P =
        detail::congruence<float, 6, 6>(lever.adjoint(), Matrix6<float>(wide.cwiseAbs2().asDiagonal()));
    const auto x =
        Single::from_rotation_translation(Vector4<float>(1, 0, 0, 0), Vector3<float>(scale / 100, 0, 0));
    for (int k = 0; k < 100; ++k) {
      const PoseGaussian<float> origin{Single(), P};
      const PoseGaussian<float> a{x * sample(origin, rng), P}, b{x * sample(origin, rng), P};
      CHECK(fuse(a, b).converged);
    }
  }
}

TEST_CASE("Fusing concentrated estimates adds their information", "[fusion]") {
  for (unsigned seed = 0; seed < 20; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto x = random_pose<double>(rng);
    const Matrix6<double> A = 1e-8 * random_covariance<double, 6>(rng),
                          B = 1e-8 * random_covariance<double, 6>(rng);
    const auto a = estimate(rng, x, A), b = estimate(rng, x, B);
    const auto fused = fuse(a, b);
    const Matrix6<double> information = A.inverse() + B.inverse();
    // Errors of 1e-4 rad and m bend the chart by as much.
    CHECK(max_difference(Matrix6<double>(fused.density.covariance * information),
                         Matrix6<double>(Matrix6<double>::Identity())) <= 1e-2);
    const Vector6<double> r = b.pose.boxminus(a.pose);
    CHECK(fused.mahalanobis_squared == Approx(r.dot((A + B).inverse() * r)).epsilon(1e-3));
    const double log_evidence = -0.5 * fused.mahalanobis_squared -
                                0.5 * std::log((2.0 * 3.14159265358979323846 * (A + B)).determinant());
    CHECK(fused.log_evidence == Approx(log_evidence).epsilon(1e-3));
    const auto swapped = fuse(b, a);
    CHECK(swapped.density.pose.is_approx(fused.density.pose, 1e-9));
    CHECK(max_difference(swapped.density.covariance, fused.density.covariance) <= 1e-13);
    const Density flipped{Pose::unchecked(-a.pose.coeffs()), a.covariance};
    CHECK(fuse(flipped, b).density.pose.is_approx(fused.density.pose, 1e-12));
  }
}

TEST_CASE("An estimate fused with one that knows nothing, or with itself certain, stays", "[fusion]") {
  Rng rng(2);
  const auto x = random_pose<double>(rng);
  const Density a = estimate(rng, x, 1e-4 * random_covariance<double, 6>(rng));
  const Density vague{a.pose, 1e12 * Matrix6<double>::Identity()};
  CHECK(fuse(a, vague).density.pose.is_approx(a.pose, 1e-12));
  CHECK(max_difference(fuse(a, vague).density.covariance, a.covariance) <= 1e-14);
  const Density certain{a.pose.boxplus(Vector6<double>::Constant(0.01)), Matrix6<double>::Zero()};
  const auto fused = fuse(a, certain);
  CHECK(fused.converged);
  CHECK(fused.density.pose.is_approx(certain.pose, 1e-12));
  CHECK(fused.density.covariance.isZero(1e-15));
  // A planar estimate takes the rest from the other.
  Vector6<double> planar;
  planar << 0, 0, 1e-2, 1e-2, 1e-2, 0;
  const auto on_plane =
      fuse(Density{Pose(), planar.asDiagonal()}, estimate(rng, Pose(), 1e-4 * Matrix6<double>::Identity()));
  CHECK(on_plane.converged);
  CHECK(on_plane.density.covariance(0, 0) == 0.0);
  CHECK(on_plane.density.covariance(2, 2) == Approx(1e-6 / (1e-2 + 1e-4)).epsilon(0.01));
}

TEST_CASE("Two certain estimates agree or are reported", "[fusion]") {
  Rng rng(3);
  const auto x = random_pose<double>(rng);
  const Density certain{x, Matrix6<double>::Zero()};
  CHECK(fuse(certain, certain).converged);
  CHECK(fuse(certain, certain).density.pose.is_approx(x, 1e-14));
  const auto contradiction =
      fuse(certain, Density{x.boxplus(Vector6<double>::Constant(0.1)), Matrix6<double>::Zero()});
  CHECK_FALSE(contradiction.converged);
  CHECK(std::isinf(contradiction.mahalanobis_squared));
}

TEST_CASE("Estimates half a turn apart come back with a status and a large distance", "[fusion]") {
  const Matrix6<double> P = 1e-4 * Matrix6<double>::Identity();
  for (const double angle : {1.5, 3.0, 3.1415}) {
    Vector6<double> xi = Vector6<double>::Zero();
    xi[1] = angle;
    const auto fused = fuse(Density{Pose(), P}, Density{Pose::exp(xi), P});
    CHECK(fused.density.pose.coeffs().allFinite());
    if (fused.converged) CHECK(fused.mahalanobis_squared > 1e3);
  }
}

TEST_CASE("Bad covariances and poses are refused by fuse, sample and nees", "[fusion][error]") {
  const Density good{Pose(), Matrix6<double>::Identity()};
  Density bad = good;
  bad.covariance(2, 2) = -1.0;
  CHECK(contains(error_message([&] { return fuse(good, bad); }), "negative eigenvalue"));
  Rng rng(4);
  CHECK(contains(error_message([&] { return sample(bad, rng); }), "negative eigenvalue"));
  bad.covariance(2, 2) = std::numeric_limits<double>::quiet_NaN();
  CHECK(contains(error_message([&] { return fuse(bad, good); }), "not finite"));
  CHECK(contains(error_message([&] { return nees(bad, Pose()); }), "not finite"));
  CHECK_THROWS_AS(nees(Density{Pose(), Matrix6<double>::Zero()}, Pose()), std::domain_error);
}

TEST_CASE("Draws have the covariance, and NEES is six on average", "[fusion][random]") {
  Rng rng(5);
  constexpr int kDraws = 20000;
  const Density x{random_pose<double>(rng), random_covariance<double, 6>(rng)};
  Matrix6<double> squares = Matrix6<double>::Zero();
  double sum = 0.0;
  // Rotations of a radian: the log of one beyond pi comes back on the other side.
  const Density narrow{x.pose, 0.1 * x.covariance};
  for (int k = 0; k < kDraws; ++k) {
    const auto pose = sample(narrow, rng);
    const Vector6<double> xi = pose.boxminus(narrow.pose);
    squares += xi * xi.transpose() / kDraws;
    sum += mahalanobis_squared(narrow, pose) / kDraws;
  }
  CHECK(std::abs(sum - 6.0) <= 5.0 * std::sqrt(12.0 / kDraws));
  CHECK(max_difference(squares, narrow.covariance) <= 5.0 * 0.1 * std::sqrt(2.0 / kDraws));
  const auto same = sample(Density{x.pose, Matrix6<double>::Zero()}, rng);
  CHECK(same.is_approx(x.pose, 1e-14));
}

TEST_CASE("The position's marginal is that of draws, in the parent's axes", "[fusion][random]") {
  Rng rng(6);
  constexpr int kDraws = 100000;
  Vector6<double> sigma;
  sigma << 0.3, 0.2, 0.3, 1.0, 0.5, 2.0;
  const Density x{random_pose<double>(rng), covariance(sigma, {3, 0, 0})};
  const auto marginal = translation_marginal(x);
  Vector3<double> mean = Vector3<double>::Zero();
  Matrix3<double> squares = Matrix3<double>::Zero();
  for (int k = 0; k < kDraws; ++k) {
    const Vector3<double> d = sample(x, rng).translation() - marginal.mean();
    mean += d / kDraws;
    squares += d * d.transpose() / kDraws;
  }
  const double largest = marginal.covariance().trace();
  // Five standard errors, and what is of third order: sigma^4 of the rotation.
  CHECK(mean.norm() <= 5.0 * std::sqrt(largest / kDraws) + 0.3 * 0.3 * 0.3 * 0.3 * 3.0);
  CHECK(max_difference(squares, marginal.covariance()) <=
        5.0 * largest * std::sqrt(2.0 / kDraws) + 0.3 * 0.3 * 0.3 * 0.3 * largest);
  // The mode of the orientation is that of the pose.
  CHECK(std::abs(orientation_marginal(x).mode().dot(x.pose.rotation())) == Approx(1.0).margin(1e-12));
}

TEST_CASE("Estimates by position and attitude apart are fused in their own chart", "[fusion][random]") {
  // The positions are measured in the parent's axes: attitudes known to 0.3 rad do not bend them.
  Rng rng(7);
  constexpr int kPairs = 500;
  const Matrix6<double> A = covariance((Vector6<double>() << 0.3, 0.2, 0.3, 10, 10, 1).finished());
  const Matrix6<double> B = covariance((Vector6<double>() << 0.2, 0.3, 0.3, 1, 10, 10).finished());
  double sum = 0.0;
  for (int k = 0; k < kPairs; ++k) {
    const auto x = random_pose<double>(rng);
    const auto measured = [&](const Matrix6<double>& P) {
      const Pose error = sample(SplitPoseGaussian<double>{Pose(), P}, rng);
      return SplitPoseGaussian<double>{
          Pose::from_rotation_translation(hamilton_product(x.rotation(), conjugate(error.rotation())),
                                          Vector3<double>(x.translation() - error.translation())),
          P};
    };
    const auto fused = fuse(measured(A), measured(B));
    REQUIRE(fused.converged);
    sum += nees(fused.density, x) / kPairs;
  }
  CHECK(std::abs(sum - 6.0) <= 0.6);
}

TEST_CASE("An estimate that does not know some coordinates takes these from the other", "[fusion]") {
  // Whatever "does not know" is written as, the answer is the same.
  Vector6<double> apart;
  apart << 0.1, -0.2, 0.3, 0.4, 0.5, -0.6;
  const Density a{Pose(), 0.01 * Matrix6<double>::Identity()};
  const auto fused_with = [&](double unknown, const Vector6<double>& known) {
    Vector6<double> variances = known;
    for (double& variance : variances) variance = variance > 0.0 ? variance : unknown;
    return fuse(a, Density{Pose::exp(apart), variances.asDiagonal()});
  };
  for (const int pattern : {1, 7, 8, 56, 36, 62, 63}) {
    CAPTURE(pattern);
    Vector6<double> known = Vector6<double>::Constant(0.02);
    for (int i = 0; i < 6; ++i) {
      if (pattern >> i & 1) known[i] = 0.0;
    }
    const auto expected = fused_with(1e10, known);
    REQUIRE(expected.converged);
    for (const double unknown : {1e12, 1e16, 1e20, 1e40, 1e150, 1e300, 1.7e308}) {
      CAPTURE(unknown);
      const auto fused = fused_with(unknown, known);
      REQUIRE(fused.converged);
      // 1e10 is 1e-11 as much as the known variances.
      CHECK(fused.density.pose.is_approx(expected.density.pose, 1e-8));
      CHECK(max_difference(fused.density.covariance, expected.density.covariance) <= 1e-9);
      CHECK(fused.mahalanobis_squared == Approx(expected.mahalanobis_squared).margin(1e-6));
      CHECK(std::isfinite(fused.log_evidence));
      const int unknowns = std::popcount(static_cast<unsigned>(pattern));
      CHECK(fused.log_evidence - expected.log_evidence ==
            Approx(-0.5 * unknowns * std::log(unknown / 1e10)).epsilon(1e-6));
    }
  }
}

TEST_CASE("A variance that is lost beside others is reported", "[fusion][error]") {
  // 1e18 along an oblique axis: in double precision, the covariance says nothing about the others.
  Rng rng(9);
  const Matrix6<double> Q = random_orthogonal<double, 6>(rng);
  Vector6<double> variances = Vector6<double>::Constant(0.01);
  variances[3] = 1e18;
  const Density a{Pose(), 0.01 * Matrix6<double>::Identity()};
  const Density b{Pose(), detail::scaled_square<double, 6, 6>(Q, variances)};
  const auto fused = fuse(a, b);
  if (fused.converged) {
    CHECK(max_difference(fused.density.covariance, 0.005 * Matrix6<double>::Identity()) <= 0.005);
  } else {
    CHECK(fused.density.covariance.allFinite());
  }
}
