// SPDX-License-Identifier: MIT
#include <cmath>
#include <limits>

#include <antipode/distributions/projected_gaussian_conversions.hpp>
#include <antipode/sampling/sample_projected_gaussian.hpp>
#include <antipode/sampling/sigma_point_rule.hpp>

#include "distributions/random_projected_gaussians.hpp"
#include "support/catch.hpp"
#include "support/error_message.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

static_assert(PoseRule<MysovskikhRule<6>, ProjectedGaussian<double>>);
static_assert(PoseRule<CubatureRule<6>, PushForwardGaussian<float>>);

template <class Scalar>
Matrix6<Scalar> scaled(const Matrix6<Scalar>& A, const Matrix6<Scalar>& like) {
  Matrix6<Scalar> B;
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) B(i, j) = A(i, j) / std::sqrt(like(i, i)) / std::sqrt(like(j, j));
  }
  return B;
}

/// Largest entry of |A - B| relative to the standard deviations in A.
template <class Scalar>
double relative_difference(const Matrix6<Scalar>& A, const Matrix6<Scalar>& B) {
  return max_difference(scaled(A, A), scaled(B, A));
}

}  // namespace

TEMPLATE_TEST_CASE("Conversion of a Gaussian in exponential coordinates and back is exact",
                   "[projected][conversion][law]", float, double) {
  for (unsigned seed = 0; seed < 40; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto x = random_density_at<ProjectedGaussian<TestType>>(rng, random_pose<TestType>(rng), 0.3, 1.0);
    const auto back = to_projected_gaussian(to_pose_gaussian(x));
    CHECK(back.pose().is_approx(x.pose(), static_cast<TestType>(10 * kEpsilon<TestType>)));
    CHECK(relative_difference(x.covariance(), back.covariance()) <= 40 * kEpsilon<TestType>);
  }
}

TEST_CASE("Draws have the converted covariance in exponential coordinates",
          "[projected][conversion][random]") {
  Rng rng(1);
  const auto x = random_density_at<PushForwardGaussian<double>>(rng, random_pose<double>(rng), 0.02, 0.3);
  const auto gaussian = to_pose_gaussian(x);
  constexpr int kDraws = 40000;
  Matrix6<double> squares = Matrix6<double>::Zero();
  for (int k = 0; k < kDraws; ++k) {
    const Vector6<double> xi = x.sample(rng).boxminus(gaussian.pose);
    detail::add_outer_product(1.0 / kDraws, xi, xi, squares);
  }
  // Five standard errors, and the second order of rotations of 0.04 rad.
  CHECK(relative_difference(gaussian.covariance, squares) <= 5.0 * std::sqrt(2.0 / kDraws) + 0.01);
}

TEMPLATE_TEST_CASE("Conversion of a projected Gaussian to a Bingham density and back is exact",
                   "[projected][conversion][law]", float, double) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const double sigma_u = seed % 2 ? 0.5 : 0.03;
    const auto x =
        random_density_at<ProjectedGaussian<TestType>>(rng, random_pose<TestType>(rng), sigma_u, 1.0);
    const auto bingham = to_bingham_gaussian(x);
    const auto back = to_projected_gaussian(bingham);
    CHECK(bingham.pose().is_approx(x.pose(), static_cast<TestType>(20 * kEpsilon<TestType>)));
    CHECK(back.pose().is_approx(x.pose(), static_cast<TestType>(20 * kEpsilon<TestType>)));
    // The second moments of the orientation carry the relative error epsilon over the smallest of them.
    const double smallest = static_cast<double>(bingham.orientation().second_moments()[0]);
    CHECK(relative_difference(x.covariance(), back.covariance()) <= 50 * kEpsilon<TestType> / smallest);
  }
}

TEST_CASE("A concentrated pose has the same density as either", "[projected][conversion]") {
  // The log densities differ by terms of the order of |u|^2 and |u|^4/sigma^2: 4 and 6 sigma^2 for the draws.
  for (const double sigma_u : {1e-2, 1e-3, 1e-5}) {
    CAPTURE(sigma_u);
    Rng rng(2);
    const auto x = random_density_at(rng, random_pose<double>(rng), sigma_u, 1.0);
    const auto bingham = to_bingham_gaussian(x);
    for (int k = 0; k < 20; ++k) {
      const auto pose = x.sample(rng);
      CHECK(std::abs(bingham.log_density(pose) - x.log_density(pose)) <= 200.0 * sigma_u * sigma_u + 1e-5);
    }
    const auto P = to_pose_gaussian(x).covariance;
    CHECK(relative_difference(P, bingham.covariance()) <= 4.0 * sigma_u * sigma_u + 1e-9);
  }
}

TEST_CASE("Correlation at its limit and certainty convert", "[projected][conversion]") {
  Rng rng(3);
  const auto pose = random_pose<double>(rng);
  const auto certain = to_bingham_gaussian(ProjectedGaussian<double>(pose, Matrix6<double>::Zero()));
  CHECK(certain.pose().is_approx(pose, 1e-12));
  CHECK(to_projected_gaussian(certain).covariance().cwiseAbs().maxCoeff() <= 2e-14);

  // A lever: the translation is a function of the rotation.
  Matrix<double, 6, 3> lever;
  lever << 0.5 * Matrix3<double>::Identity(), random_matrix<double, 3>(rng, 2.0);
  const ProjectedGaussian<double> rigid(pose, lever * lever.transpose());
  const auto bingham = to_bingham_gaussian(rigid);
  CHECK(bingham.conditional_covariance().cwiseAbs().maxCoeff() <= 1e-12);
  CHECK(relative_difference(rigid.covariance(), to_projected_gaussian(bingham).covariance()) <= 1e-12);

  const ProjectedGaussian<double> wide(pose, 1.1 * Matrix6<double>::Identity());
  CHECK(contains(error_message([&] { return to_bingham_gaussian(wide); }), "too wide"));
}

TEST_CASE("The push-forward matched to a renormalised density has its moments",
          "[projected][conversion][random]") {
  Rng rng(4);
  const auto x = random_density_at(rng, random_pose<double>(rng), 0.4, 1.0);
  const auto matched = match_push_forward(x);
  constexpr int kDraws = 40000;
  Matrix6<double> squares = Matrix6<double>::Zero();
  for (int k = 0; k < kDraws; ++k) {
    const Vector6<double> y = x.coordinates(x.sample(rng)) - x.mean();
    detail::add_outer_product(1.0 / kDraws, y, y, squares);
  }
  // Five standard errors; u is a little heavier in the tails than a Gaussian would be.
  CHECK(relative_difference(matched.covariance(), squares) <= 5.0 * std::sqrt(3.0 / kDraws));
  CHECK(relative_difference(x.covariance(), squares) > 0.05);

  const auto back = match_renormalized(matched);
  REQUIRE(back.has_value());
  CHECK(relative_difference(x.covariance(), back->covariance()) <= 1e-8);
}

TEST_CASE("A push-forward too wide about an axis for a renormalised density has none",
          "[projected][conversion]") {
  Rng rng(5);
  Vector6<double> variances;
  variances << 1.5, 1e-4, 1e-4, Vector3<double>::Ones();
  const PushForwardGaussian<double> wide(random_pose<double>(rng), variances.asDiagonal());
  CHECK_FALSE(match_renormalized(wide).has_value());
  const PushForwardGaussian<double> certain(random_pose<double>(rng), Matrix6<double>::Zero());
  const auto matched = match_renormalized(certain);
  REQUIRE(matched.has_value());
  CHECK(matched->covariance().cwiseAbs().maxCoeff() == 0.0);
}

TEST_CASE("Sigma points of a push-forward fit it again, whatever their signs",
          "[projected][conversion][law]") {
  for (unsigned seed = 0; seed < 10; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto x = random_density_at<PushForwardGaussian<double>>(rng, random_pose<double>(rng), 0.3, 1.0);
    auto points = sample(MysovskikhRule<6>{}, x);
    for (int k = 0; k < points.size(); k += 2) points.points.col(k) *= double(-1);
    const auto fitted = fit_projected_gaussian(points.points, double(3) * points.weights);
    CHECK(fitted.pose().is_approx(x.pose(), static_cast<double>(100 * kEpsilon<double>)));
    CHECK(relative_difference(x.covariance(), fitted.covariance()) <= 500 * kEpsilon<double>);
  }
}

TEST_CASE("Sigma points of a renormalised density have its moments where it is concentrated",
          "[projected][conversion]") {
  Rng rng(6);
  const auto x = random_density_at(rng, random_pose<double>(rng), 0.1, 1.0);
  const auto points = sample(MysovskikhRule<6>{}, x);
  const auto fitted = fit_projected_gaussian(points.points, points.weights);
  // A degree-5 rule sees the tilt to second order: what is left is of order (2 tr Sigma_uu)^2 = 4e-3.
  CHECK(relative_difference(match_push_forward(x).covariance(), fitted.covariance()) <= 4e-3);
}

TEST_CASE("A fit follows the law of large numbers", "[projected][conversion][random]") {
  Rng rng(7);
  const auto x = random_density_at<PushForwardGaussian<double>>(rng, random_pose<double>(rng), 0.3, 1.0);
  constexpr int kDraws = 5000;
  Matrix<double, 8, Eigen::Dynamic> poses(8, kDraws);
  for (int k = 0; k < kDraws; ++k) poses.col(k) = x.sample(rng).coeffs();
  const auto fitted = fit_projected_gaussian(poses, Vector<double, Eigen::Dynamic>::Ones(kDraws));
  CHECK(relative_difference(x.covariance(), fitted.rebased(x.tangent_point()).covariance()) <=
        5.0 * std::sqrt(2.0 / kDraws));
}

TEST_CASE("Samples that determine no density are refused", "[projected][conversion][error]") {
  Rng rng(8);
  Matrix<double, 8, Eigen::Dynamic> poses(8, 10);
  for (int k = 0; k < 10; ++k) poses.col(k) = random_pose<double>(rng).coeffs();
  using Weights = Vector<double, Eigen::Dynamic>;
  const auto message = [&](const Weights& weights) {
    return error_message([&] { return fit_projected_gaussian(poses, weights); });
  };
  CHECK(contains(message(Weights::Zero(10)), "positive sum"));
  CHECK(contains(message(-Weights::Ones(10)), "positive sum"));
  CHECK(contains(message(Weights::Ones(9)), "one weight per sample"));
  CHECK(contains(message(Weights::Constant(10, std::numeric_limits<double>::quiet_NaN())), "weights"));
  poses(2, 3) = std::numeric_limits<double>::quiet_NaN();
  CHECK(contains(message(Weights::Ones(10)), "not a unit dual quaternion"));
}
