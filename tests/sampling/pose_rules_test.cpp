// SPDX-License-Identifier: MIT
#include <cmath>

#include <antipode/sampling/point_sets.hpp>
#include <antipode/sampling/pose_rules.hpp>

#include "distributions/random_densities.hpp"
#include "support/catch.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

/// What every pose rule promises: a probability over poses with E[q q^T], E[t] and Cov(t | q) of the density.
template <class Rule, class Scalar>
void check_laws(const Rule& rule, const BinghamGaussian<Scalar>& x) {
  const auto samples = sample(rule, x);
  CHECK(samples.weights.minCoeff() >= Scalar(0));
  CHECK(static_cast<double>(std::abs(samples.weights.sum() - Scalar(1))) <= 20 * kEpsilon<Scalar>);
  Matrix4<Scalar> scatter = Matrix4<Scalar>::Zero();
  Vector3<Scalar> mean = Vector3<Scalar>::Zero();
  Matrix<Scalar, 3, 6> residual = Matrix<Scalar, 3, 6>::Zero();
  for (int k = 0; k < samples.size(); ++k) {
    const auto pose = DualQuaternion<Scalar>::unchecked(samples.points.col(k));
    REQUIRE(static_cast<double>(std::abs(pose.real().norm() - Scalar(1))) <= 8 * kEpsilon<Scalar>);
    REQUIRE(static_cast<double>(std::abs(pose.real().dot(pose.dual()))) <= 20 * kEpsilon<Scalar>);
    scatter += samples.weights[k] * pose.rotation() * pose.rotation().transpose();
    mean += samples.weights[k] * pose.translation();
    const Vector3<Scalar> r = pose.translation() - x.conditional_mean(pose.rotation());
    residual.template leftCols<3>() += samples.weights[k] * r * r.transpose();
    residual.template rightCols<3>() +=
        samples.weights[k] * r * x.orientation_offset(pose.rotation()).transpose();
  }
  const double tolerance = 100 * kEpsilon<Scalar>;
  CHECK(max_difference(scatter, x.orientation().scatter()) <= tolerance);
  CHECK(max_difference(mean, x.mean_translation()) <= tolerance);
  CHECK(max_difference(residual.template leftCols<3>(), x.conditional_covariance()) <= tolerance);
  CHECK(static_cast<double>(residual.template rightCols<3>().cwiseAbs().maxCoeff()) <= tolerance);
}

/// Covariance of (tau, t) over the samples.
template <class Rule>
Matrix6<double> joint_covariance(const Rule& rule, const BinghamGaussian<double>& x) {
  const auto samples = sample(rule, x);
  Matrix6<double> covariance = Matrix6<double>::Zero();
  for (int k = 0; k < samples.size(); ++k) {
    const auto pose = DualQuaternion<double>::unchecked(samples.points.col(k));
    Vector6<double> y;
    y << x.orientation_offset(pose.rotation()), pose.translation() - x.mean_translation();
    covariance += samples.weights[k] * y * y.transpose();
  }
  return covariance;
}

}  // namespace

TEMPLATE_TEST_CASE("Every pose rule reproduces the moments of the density", "[rules][pose][law]", float,
                   double) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto x = random_bingham_gaussian<TestType>(rng, -2.0, seed % 2 ? 2.0 : 7.0);
    check_laws(PaperPoseRule{}, x);
    check_laws(PaperPoseRule{.orientation = {.lambda = 0.2}, .translation = {.kappa = 0.5}}, x);
    check_laws(RichPoseRule{}, x);
    check_laws(JointPoseRule{}, x);
    check_laws(CartesianPoseRule<BinghamBaseRule, CubatureRule<3>>{}, x);
  }
}

TEST_CASE("Pose rules have the number of points they are known for", "[rules][pose]") {
  STATIC_REQUIRE(PaperPoseRule::kCount == 49);
  STATIC_REQUIRE(CartesianPoseRule<BinghamBaseRule, CubatureRule<3>>::kCount == 42);
  STATIC_REQUIRE(RichPoseRule::kCount == 225);
  STATIC_REQUIRE(JointPoseRule::kCount == 57);
}

TEST_CASE("Any orientation rule can be paired with any translation rule", "[rules][pose][law]") {
  Rng rng(1);
  const auto x = random_bingham_gaussian<double>(rng, -1.0, 2.0);
  using Fibonacci = PointSetRule<3, 20>;
  using Rule = CartesianPoseRule<EqualWeightRule<Fibonacci>, Fibonacci>;
  check_laws(Rule{{Fibonacci::fibonacci()}, Fibonacci::random(rng)}, x);
}

TEST_CASE("The joint rule reproduces a concentrated density like the product of degree-5 rules",
          "[rules][pose]") {
  for (unsigned seed = 0; seed < 20; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto x = random_bingham_gaussian<double>(rng, 3.0, 5.0);
    const Vector3<double> T = x.orientation_offset_variances();
    Matrix6<double> exact;
    exact << Matrix3<double>(T.asDiagonal()), T.asDiagonal() * x.coupling().transpose(),
        x.coupling() * T.asDiagonal(), x.translation_covariance();
    const Vector6<double> scale = exact.diagonal().cwiseSqrt().cwiseInverse();
    const auto error = [&](const auto& rule) {
      return (scale.asDiagonal() * (joint_covariance(rule, x) - exact) * scale.asDiagonal())
          .cwiseAbs()
          .maxCoeff();
    };
    // Of the order of omega_3 relative to the whole: see the fourth moments of the orientations.
    CHECK(error(JointPoseRule{}) <= 20.0 * x.orientation().second_moments()[2]);
    CHECK(error(RichPoseRule{}) <= 20.0 * x.orientation().second_moments()[2]);
  }
}

TEMPLATE_TEST_CASE("Samples of an independent density keep it independent", "[rules][pose][law]", float,
                   double) {
  const auto check = [](const auto& rule, const BinghamGaussian<TestType>& x) {
    const auto matched = moment_match(sample(rule, x));
    const TestType smallest = x.orientation_offset_variances().minCoeff();
    CHECK(static_cast<double>(matched.coupling().cwiseAbs().maxCoeff() * smallest) <=
          100 * kEpsilon<TestType>);
  };
  for (unsigned seed = 0; seed < 20; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto x = BinghamGaussian<TestType>::independent(random_bingham<TestType, 4>(rng, -1.0, 3.0),
                                                          random_matrix<TestType, 3, 1>(rng),
                                                          random_covariance<TestType, 3>(rng));
    check(PaperPoseRule{}, x);
    check(RichPoseRule{}, x);
    check(JointPoseRule{}, x);
  }
}

TEMPLATE_TEST_CASE("Samples move with the frame", "[rules][pose][law]", float, double) {
  // Up to the order and the signs of axes, which the rules do not depend on.
  for (unsigned seed = 0; seed < 20; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto x = random_bingham_gaussian<TestType>(rng, -1.0, 3.0);
    const auto y = random_pose<TestType>(rng);
    const auto moved = moment_match(sample(JointPoseRule{}, compose(y, x)));
    const auto expected = compose(y, moment_match(sample(JointPoseRule{}, x)));
    CHECK(max_difference(moved.orientation().scatter(), expected.orientation().scatter()) <=
          50 * kEpsilon<TestType>);
    CHECK(max_difference(moved.mean_translation(), expected.mean_translation()) <= 100 * kEpsilon<TestType>);
  }
}
