// SPDX-License-Identifier: MIT
#include <cmath>
#include <limits>
#include <numbers>

#include <antipode/distributions/pose_box.hpp>

#include "distributions/random_mixtures.hpp"
#include "support/catch.hpp"
#include "support/error_message.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

PoseBox<double> box_of(double angle, double distance) {
  Vector6<double> half;
  half << Vector3<double>::Constant(angle), Vector3<double>::Constant(distance);
  return PoseBox<double>::symmetric(half);
}

}  // namespace

TEST_CASE("Quantiles of the standard normal invert its distribution", "[box]") {
  for (const double p : {1e-12, 1e-3, 0.02, 0.03, 0.3, 0.5, 0.9, 0.975, 0.999999}) {
    CHECK(detail::standard_normal_cdf(detail::standard_normal_quantile(p)) == Approx(p).epsilon(1e-7));
  }
  CHECK(detail::standard_normal_quantile(0.975) == Approx(1.959963984540054).epsilon(1e-8));
}

TEST_CASE("A box of independent coordinates has the product of their probabilities", "[box]") {
  const Vector3<double> sigma(0.5, 1.0, 2.0), mean(0.1, -0.2, 0.3);
  const Vector3<double> lower(-0.4, -kInfinity, -1.0), upper(0.6, 1.0, kInfinity);
  double expected = 1.0;
  for (int i = 0; i < 3; ++i) {
    expected *= detail::standard_normal_cdf((upper[i] - mean[i]) / sigma[i]) -
                detail::standard_normal_cdf((lower[i] - mean[i]) / sigma[i]);
  }
  const auto box = detail::gaussian_box_probability<3>(mean, sigma.asDiagonal(), lower, upper,
                                                       [](const Vector3<double>&) { return 1.0; });
  CHECK(box.probability == Approx(expected).epsilon(1e-12));
  CHECK(box.standard_error <= 1e-12);
}

TEST_CASE("Orthants of correlated coordinates have the probabilities of the textbook", "[box]") {
  // P(x > 0, y > 0) = 1/4 + asin(rho)/(2 pi); with z: 1/8 + (the three arc sines)/(4 pi).
  Matrix3<double> Sigma;
  Sigma << 1.0, 0.5, -0.3, 0.5, 1.0, 0.2, -0.3, 0.2, 1.0;
  const auto box = detail::gaussian_box_probability<3>(
      Vector3<double>::Zero(), *detail::cholesky_factor(Sigma), Vector3<double>::Zero(),
      Vector3<double>::Constant(kInfinity), [](const Vector3<double>&) { return 1.0; });
  const double expected =
      0.125 + (std::asin(0.5) + std::asin(-0.3) + std::asin(0.2)) / (4.0 * std::numbers::pi);
  CHECK(std::abs(box.probability - expected) <= 1e-4);
  CHECK(std::abs(box.probability - expected) <= 5.0 * box.standard_error);
}

TEMPLATE_TEST_CASE("Tangent boxes contain the predicted share of draws", "[box][random]",
                   ProjectedGaussian<double>, PushForwardGaussian<double>) {
  for (unsigned seed = 0; seed < 5; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto x = random_density_at<TestType>(rng, random_pose<double>(rng), 0.4, 1.0);
    const Vector6<double> half = 1.5 * x.covariance().diagonal().cwiseSqrt();
    const Vector6<double> lower = x.mean() - half, upper = x.mean() + half;
    const auto inside = tangent_box_probability(x, lower, upper);
    constexpr int kDraws = 20000;
    int hits = 0;
    for (int k = 0; k < kDraws; ++k) {
      const Vector6<double> y = x.coordinates(x.sample(rng));
      hits += (y - lower).minCoeff() >= 0.0 && (upper - y).minCoeff() >= 0.0 ? 1 : 0;
    }
    const double p = inside.value;
    CHECK(std::abs(hits - kDraws * p) <= 4.5 * std::sqrt(kDraws * p * (1.0 - p)));
    CHECK(inside.standard_error <= 2e-3);
    const Vector6<double> everywhere = Vector6<double>::Constant(kInfinity);
    CHECK(tangent_box_probability(x, -everywhere, everywhere).value == Approx(1.0).epsilon(2e-3));
  }
}

TEST_CASE("A box contains small motions of either sign and no others", "[box]") {
  const auto box = box_of(0.2, 0.1);
  const auto motion = [](double angle, double distance) {
    Vector6<double> xi;
    xi << 0.0, angle, 0.0, distance, 0.0, 0.0;
    return DualQuaternion<double>::exp(xi);
  };
  CHECK(box.contains(motion(0.19, 0.09)));
  CHECK(box.contains(motion(-0.19, -0.09)));
  CHECK(box.contains(DualQuaternion<double>::unchecked(-motion(0.19, 0.09).coeffs())));
  CHECK_FALSE(box.contains(motion(0.21, 0.0)));
  CHECK_FALSE(box.contains(motion(0.0, 0.11)));
  CHECK_FALSE(box.contains(motion(std::numbers::pi, 0.0)));
}

TEST_CASE("A grasp maximises the probability in the box", "[box][random]") {
  Rng rng(1);
  // Two ways the object may lie: sharply known with a third of the probability, and vaguely.
  const auto pose = random_pose<double>(rng);
  const auto elsewhere = nearby_pose(rng, pose, 1.0, 1.0);
  const PoseComponent sharp(pose, 1e-4 * Matrix6<double>::Identity());
  const PoseComponent vague(elsewhere, 0.04 * Matrix6<double>::Identity());
  const PoseMixture x({{0.35, sharp}, {0.65, vague}});
  const auto grasp = best_grasp(x, box_of(0.06, 0.03), rng);
  CHECK(std::abs(grasp.probability.value - 0.35) <= 0.05);
  CHECK(grasp.pose.boxminus(pose).norm() < 0.05);
  CHECK(grasp.probability.standard_error == Approx(std::sqrt(0.35 * 0.65 / 4000.0)).epsilon(0.1));
  // A forgiving gripper goes for the likely one.
  const auto forgiving = best_grasp(x, box_of(2.0, 1.0), rng);
  CHECK(forgiving.pose.boxminus(elsewhere).norm() < 1.0);
  CHECK(forgiving.probability.value > 0.6);
}

TEST_CASE("A box that is not around its middle moves the grasp", "[box][random]") {
  Rng rng(2);
  const PoseMixture x(PoseComponent(random_pose<double>(rng), 1e-3 * Matrix6<double>::Identity()));
  PoseBox<double> box = box_of(0.2, 0.05);
  box.lower[3] = 0.1;  // only objects that lie in front of the hand
  box.upper[3] = 0.2;
  const auto grasp = best_grasp(x, box, rng);
  const double ahead = (grasp.pose.inverse() * x[0].density.pose()).translation()[0];
  CHECK(std::abs(ahead - 0.15) < 0.02);
}

TEST_CASE("Probabilities of empty boxes are refused", "[box][error]") {
  Rng rng(3);
  const auto box = box_of(0.1, 0.1);
  const auto identity = DualQuaternion<double>::identity();
  const Matrix<double, 8, Eigen::Dynamic> none(8, 0);
  CHECK(contains(error_message([&] { return box_probability(none, identity, box); }), "needs draws"));
  const PoseComponent certain(identity, Matrix6<double>::Zero());
  CHECK_THROWS_AS(tangent_box_probability(certain, box.lower, box.upper), std::domain_error);
  CHECK(contains(error_message([&] { return best_grasp(PoseMixture(certain), box, rng, {.draws = 0}); }),
                 "needs draws and starts"));
  CHECK(best_grasp(PoseMixture(certain), box, rng, {.draws = 10}).probability.value == 1.0);
  for (const double size : {0.0, -0.1, kInfinity, std::numeric_limits<double>::quiet_NaN()}) {
    CHECK(contains(error_message([&] { return best_grasp(PoseMixture(certain), box_of(0.1, size), rng); }),
                   "finite with a positive volume"));
  }
}
