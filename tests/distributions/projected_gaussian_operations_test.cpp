// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <antipode/distributions/projected_gaussian_operations.hpp>

#include "distributions/random_projected_gaussians.hpp"
#include "support/catch.hpp"
#include "support/error_message.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

/// Entries of the covariances relative to the standard deviations of the first, and of the means likewise.
template <class Density>
double relative_difference(const Density& a, const Density& b) {
  const auto moved = b.rebased(a.tangent_point());
  double difference = 0.0;
  for (int i = 0; i < 6; ++i) {
    const auto sigma_i = std::sqrt(a.covariance()(i, i));
    const auto mean = (moved.mean()[i] - a.mean()[i]) / sigma_i;
    difference = std::max(difference, static_cast<double>(std::abs(mean)));
    for (int j = 0; j < 6; ++j) {
      const auto entry = (moved.covariance()(i, j) - a.covariance()(i, j)) / sigma_i;
      difference =
          std::max(difference, static_cast<double>(std::abs(entry / std::sqrt(a.covariance()(j, j)))));
    }
  }
  return difference;
}

/// Jeffreys' divergence of the Gaussians.
double divergence(const ProjectedGaussian<double>& a, const ProjectedGaussian<double>& b) {
  const auto moved = b.rebased(a.tangent_point());
  const Matrix6<double>&L_a = a.sqrt_factor(), &L_b = moved.sqrt_factor();
  const Vector6<double> d = moved.mean() - a.mean();
  const auto squares = [&](const Matrix6<double>& L, const Matrix6<double>& other) {
    return detail::solve_lower(L, other).squaredNorm() +
           detail::solve_lower<double, 6, 1>(L, d).squaredNorm();
  };
  return 0.5 * (squares(L_a, L_b) + squares(L_b, L_a)) - 6.0;
}

template <class Density>
std::pair<Density, Density> compatible_pair(Rng& rng, double sigma_u, double angle) {
  const auto pose = random_pose<typename Density::Scalar>(rng);
  return {random_density_at<Density>(rng, pose, sigma_u, 0.5),
          random_density_at<Density>(rng, nearby_pose(rng, pose, angle, 0.3), sigma_u, 0.5)};
}

}  // namespace

TEMPLATE_TEST_CASE("Fusion is commutative and independent of signs", "[projected][fusion][law]",
                   ProjectedGaussian<float>, ProjectedGaussian<double>, PushForwardGaussian<double>) {
  using Scalar = typename TestType::Scalar;
  for (unsigned seed = 0; seed < 30; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto [a, b] = compatible_pair<TestType>(rng, 0.2, 0.3);
    const auto ab = fuse(a, b);
    // The covariances have a condition of at most 1e2 and their sum of as much.
    const double rounding = 2e3 * kEpsilon<Scalar>;
    for (const auto& other : {fuse(b, a), fuse(a, with_flipped_sign(b)), fuse(with_flipped_sign(a), b)}) {
      CHECK(relative_difference(ab.density, other.density) <= rounding);
      CHECK(std::abs(static_cast<double>(ab.log_mass - other.log_mass)) <= rounding);
      CHECK(static_cast<double>(other.linearization_bound) ==
            Approx(static_cast<double>(ab.linearization_bound)).epsilon(rounding));
    }
    CHECK(ab.density.is_centered());
  }
}

TEST_CASE("On one tangent space the fused density is the normalised product, exactly",
          "[projected][fusion]") {
  for (unsigned seed = 0; seed < 20; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    // Equal modes: then nothing is linearised at all.
    const auto pose = random_pose<double>(rng);
    const auto translated =
        DualQuaternion<double>::from_rotation_translation(pose.rotation(), pose.translation());
    const auto a = random_density_at(rng, pose, 0.5, 0.5), b = random_density_at(rng, translated, 0.5, 0.5);
    const auto fused = fuse(a, b);
    CHECK(fused.linearization_bound <= 1e-12);
    for (int k = 0; k < 5; ++k) {
      const auto x = a.sample(rng);
      CHECK(std::abs(a.log_density(x) + b.log_density(x) - fused.log_mass - fused.density.log_density(x)) <=
            1e-11 * (1.0 + std::abs(a.log_density(x)) + std::abs(b.log_density(x))));
    }
  }
}

TEST_CASE("The mass of a product of push-forwards is its integral", "[projected][fusion][random]") {
  Rng rng(3);
  const auto [a, b] = compatible_pair<PushForwardGaussian<double>>(rng, 0.4, 0.0);
  constexpr int kDraws = 200000;
  double sum = 0.0, squares = 0.0;
  for (int k = 0; k < kDraws; ++k) {
    const double value = std::exp(b.log_density(a.sample(rng)));
    sum += value / kDraws;
    squares += value * value / kDraws;
  }
  const double error = std::sqrt((squares - sum * sum) / kDraws);
  CHECK(std::abs(std::exp(fuse(a, b).log_mass) - sum) <= 4.0 * error);
}

TEST_CASE("A fused pose lies at the more precise of two poses", "[projected][fusion]") {
  Rng rng(4);
  const auto pose = random_pose<double>(rng);
  const ProjectedGaussian<double> precise(pose, 1e-10 * Matrix6<double>::Identity());
  const auto vague = random_density_at(rng, nearby_pose(rng, pose, 0.2, 0.2), 0.3, 1.0);
  const auto fused = fuse(precise, vague).density;
  CHECK(relative_difference(precise, fused) <= 1e-3);
  CHECK(fused.positive_definite());
  const ProjectedGaussian<double> certain(pose, Matrix6<double>::Zero());
  CHECK(fuse(certain, vague).density.pose().is_approx(pose, 1e-12));
  CHECK(contains(error_message([&] { return fuse(certain, certain); }), "certain about the same"));
}

TEST_CASE("The error of fusion by linearisation is within its bound", "[projected][fusion]") {
  for (unsigned seed = 0; seed < 40; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto [a, b] = compatible_pair<ProjectedGaussian<double>>(rng, seed % 2 ? 0.1 : 0.02, 0.4);
    const auto fused = fuse(a, b);
    constexpr int kDraws = 2000;
    double squares = 0.0;
    for (int k = 0; k < kDraws; ++k) {
      const auto x = fused.density.sample(rng);
      const double error =
          a.log_density(x) + b.log_density(x) - fused.log_mass - fused.density.log_density(x);
      squares += error * error / kDraws;
    }
    CHECK(std::sqrt(squares) <= fused.linearization_bound);
  }
}

TEST_CASE("The order of fusion matters no more than the bounds of linearisation say", "[projected][fusion]") {
  for (unsigned seed = 0; seed < 40; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto pose = random_pose<double>(rng);
    const auto near = [&] {
      return random_density_at(rng, nearby_pose(rng, pose, 0.15, 0.1), seed % 2 ? 0.15 : 0.03, 0.3);
    };
    const auto a = near(), b = near(), c = near();
    const auto ab = fuse(a, b), bc = fuse(b, c);
    const auto ab_c = fuse(ab.density, c), a_bc = fuse(a, bc.density);
    const double bound =
        ab.linearization_bound + ab_c.linearization_bound + bc.linearization_bound + a_bc.linearization_bound;
    // Jeffreys' divergence is the variance of the log ratio, to second order.
    CHECK(std::sqrt(divergence(ab_c.density, a_bc.density)) <= bound);
    CHECK(std::abs(ab.log_mass + ab_c.log_mass - bc.log_mass - a_bc.log_mass) <= bound);
  }
}

TEST_CASE("Tangent points too far apart are not fused", "[projected][fusion][error]") {
  Rng rng(5);
  const auto pose = random_pose<double>(rng);
  const auto a = random_density_at(rng, pose, 0.1, 0.1);
  const auto b = random_density_at(rng, nearby_pose(rng, pose, 0.6, 0.1), 0.1, 0.1);
  CHECK(tangent_angle(a, b) == Approx(0.3));
  const std::string message = error_message([&] { return fuse(a, b); });
  const std::string cause = "too far apart to fuse, by [rad]: ";
  REQUIRE(contains(message, cause));
  CHECK(std::stod(message.substr(message.find(cause) + cause.size())) == Approx(0.3));
  CHECK(error_message([&] { return fuse(a, b, {.max_angle = 0.31}); }) == "nothing thrown");
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  CHECK(contains(error_message([&] { return fuse(a, a, {.max_angle = kNan}); }), "too far apart"));
}

TEMPLATE_TEST_CASE("Composition is associative and inversion undoes it", "[projected][composition][law]",
                   ProjectedGaussian<float>, PushForwardGaussian<double>) {
  using Scalar = typename TestType::Scalar;
  for (unsigned seed = 0; seed < 20; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto a = random_density_at<TestType>(rng, random_pose<Scalar>(rng), 0.1, 0.3);
    const auto b = random_density_at<TestType>(rng, random_pose<Scalar>(rng), 0.1, 0.3);
    const auto c = random_density_at<TestType>(rng, random_pose<Scalar>(rng), 0.1, 0.3);
    // Linearisations of the same map at the same point: equal but for rounding, with levers of length 10.
    const double rounding = 2e3 * kEpsilon<Scalar>;
    CHECK(relative_difference(compose(compose(a, b), c), compose(a, compose(b, c))) <= rounding);
    CHECK(relative_difference(inverse(inverse(a)), a) <= rounding);
    CHECK(relative_difference(inverse(compose(a, b)), compose(inverse(b), inverse(a))) <= rounding);
    const auto identity = DualQuaternion<Scalar>::identity();
    CHECK(relative_difference(compose(identity, a), a) <= rounding);
    CHECK(relative_difference(compose(a, identity), a) <= rounding);
    const auto certain = random_pose<Scalar>(rng);
    const TestType density_of_certain(certain, Matrix6<Scalar>::Zero());
    CHECK(relative_difference(compose(certain, a), compose(density_of_certain, a)) <= rounding);
    CHECK(relative_difference(relative_pose(density_of_certain, a), compose(certain.inverse(), a)) <=
          rounding);
  }
}

TEST_CASE("A change of the parent frame moves a density exactly", "[projected][composition][law]") {
  for (unsigned seed = 0; seed < 20; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto x = random_density_at(rng, random_pose<double>(rng), 0.6, 1.0);
    const auto y = random_pose<double>(rng), pose = x.sample(rng);
    const double expected = x.log_density(pose);
    CHECK(std::abs(compose(y, x).log_density(y * pose) - expected) <= 1e-10 * (1.0 + std::abs(expected)));
  }
}

TEST_CASE("Composition and inversion have the Jacobians of what they do", "[projected][composition]") {
  // Of a certain other factor the covariance is J Sigma J^T; unit covariances give J J^T, compared through
  // the sigma points of a tiny spread, which differentiate numerically.
  for (unsigned seed = 0; seed < 20; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto tiny = [&] { return random_density_at(rng, random_pose<double>(rng), 1e-4, 1e-4); };
    const auto a = tiny(), b = tiny();
    // Sigma points are off by the second order: 1e-4 relative to the spread, and 1e-8 of means of 1e0.
    CHECK(relative_difference(compose(a, b), compose(a, b, Transport::kUnscented)) <= 3e-3);
    CHECK(relative_difference(inverse(a), inverse(a, Transport::kUnscented)) <= 3e-3);
    CHECK(relative_difference(relative_pose(a, b), relative_pose(a, b, Transport::kUnscented)) <= 3e-3);
  }
}

TEST_CASE("Sigma points model how a wide rotation shortens the lever", "[projected][composition][random]") {
  Rng rng(6);
  const auto a = random_density_at<PushForwardGaussian<double>>(rng, random_pose<double>(rng), 0.3, 0.1);
  const auto b = random_density_at<PushForwardGaussian<double>>(rng, random_pose<double>(rng), 0.1, 0.1);
  const auto linear = compose(a, b), unscented = compose(a, b, Transport::kUnscented);
  constexpr int kDraws = 100000;
  Vector3<double> mean = Vector3<double>::Zero();
  for (int k = 0; k < kDraws; ++k) mean += (a.sample(rng) * b.sample(rng)).translation() / kDraws;
  CHECK((unscented.pose().translation() - mean).norm() < 0.25 * (linear.pose().translation() - mean).norm());
}
