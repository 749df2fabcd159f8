// SPDX-License-Identifier: MIT
#include <cmath>

#include <antipode/cubature/point_sets.hpp>
#include <antipode/detail/products.hpp>
#include <antipode/sampling/pose_rules.hpp>

#include "distributions/random_densities.hpp"
#include "sampling/sample_list.hpp"
#include "support/catch.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

[[nodiscard]] BinghamGaussian<double> in_double(const BinghamGaussian<float>& x) {
  return {Bingham<double, 4>::from_parameters(x.orientation().axes().cast<double>(),
                                              x.orientation().concentrations().cast<double>()),
          x.mean_translation().cast<double>(), x.coupling().cast<double>(),
          x.conditional_covariance().cast<double>()};
}
[[nodiscard]] const BinghamGaussian<double>& in_double(const BinghamGaussian<double>& x) { return x; }

/// What every pose rule promises: a probability over poses with E[q q^T], E[t] and Cov(t | q) of the density.
void check_laws(const SampleList& samples, const BinghamGaussian<double>& x, double epsilon) {
  CAPTURE(samples.points.cols(), epsilon);
  CHECK(samples.weights.minCoeff() >= 0.0);
  CHECK(std::abs(samples.weights.sum() - 1.0) <= 1e-13 + 20 * epsilon);
  Matrix4<double> scatter = Matrix4<double>::Zero();
  Vector3<double> mean = Vector3<double>::Zero();
  Matrix3<double> covariance = Matrix3<double>::Zero(), correlation = Matrix3<double>::Zero();
  for (Eigen::Index k = 0; k < samples.points.cols(); ++k) {
    const auto pose = DualQuaternion<double>::unchecked(Vector8<double>(samples.points.col(k)));
    const Vector4<double> q = pose.rotation();
    REQUIRE(std::abs(q.norm() - 1.0) <= 8 * epsilon);
    REQUIRE(std::abs(pose.real().dot(pose.dual())) <= 20 * epsilon);
    const Vector3<double> residual = pose.translation() - x.conditional_mean(q);
    detail::add_outer_product(samples.weights[k], q, q, scatter);
    mean += samples.weights[k] * pose.translation();
    detail::add_outer_product(samples.weights[k], residual, residual, covariance);
    detail::add_outer_product(samples.weights[k], residual, x.orientation_offset(q), correlation);
  }
  const double tolerance = 100 * epsilon;
  CHECK(max_difference(scatter, x.orientation().scatter()) <= tolerance);
  CHECK(max_difference(mean, x.mean_translation()) <= tolerance);
  CHECK(max_difference(covariance, x.conditional_covariance()) <= tolerance);
  CHECK(max_difference(correlation, Matrix3<double>::Zero()) <= tolerance);
}

template <class Rule, class Scalar>
void check_laws(const Rule& rule, const BinghamGaussian<Scalar>& x) {
  check_laws(SampleList(sample(rule, x)), in_double(x), kEpsilon<Scalar>);
}

/// Covariance of (tau, t) over the samples.
[[nodiscard]] Matrix6<double> joint_covariance(const SampleList& samples, const BinghamGaussian<double>& x) {
  Matrix6<double> covariance = Matrix6<double>::Zero();
  for (Eigen::Index k = 0; k < samples.points.cols(); ++k) {
    const auto pose = DualQuaternion<double>::unchecked(Vector8<double>(samples.points.col(k)));
    Vector6<double> y;
    y << x.orientation_offset(pose.rotation()), pose.translation() - x.mean_translation();
    detail::add_outer_product(samples.weights[k], y, y, covariance);
  }
  return covariance;
}

/// The same of the density: (tau, t - mu) = (I; G) tau + (0; residual).
[[nodiscard]] Matrix6<double> joint_covariance(const BinghamGaussian<double>& x) {
  Matrix<double, 6, 3> J;
  J << Matrix3<double>::Identity(), x.coupling();
  Matrix6<double> covariance = detail::scaled_square<double, 6, 3>(J, x.orientation_offset_variances());
  covariance.bottomRightCorner<3, 3>() += x.conditional_covariance();
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
  // The equal weights are iterated to 256 roundings.
  const CartesianPoseRule<EqualWeightRule<Fibonacci>, CubatureRule<3>> rule{{Fibonacci::fibonacci()}, {}};
  check_laws(SampleList(sample(rule, x)), x, 4 * kEpsilon<double>);
}

TEST_CASE("The joint rule reproduces a concentrated density like the product of degree-5 rules",
          "[rules][pose]") {
  for (unsigned seed = 0; seed < 20; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto x = random_bingham_gaussian<double>(rng, 3.0, 5.0);
    const Matrix6<double> exact = joint_covariance(x);
    const auto error = [&](const SampleList& samples) {
      Matrix6<double> difference = joint_covariance(samples, x) - exact;
      for (int i = 0; i < 6; ++i) {
        for (int j = 0; j < 6; ++j) difference(i, j) /= std::sqrt(exact(i, i) * exact(j, j));
      }
      return max_difference(difference, Matrix6<double>::Zero());
    };
    // Of the order of omega_3 relative to the whole: see the fourth moments of the orientations.
    CHECK(error(SampleList(sample(JointPoseRule{}, x))) <= 20.0 * x.orientation().second_moments()[2]);
    CHECK(error(SampleList(sample(RichPoseRule{}, x))) <= 20.0 * x.orientation().second_moments()[2]);
  }
}

TEST_CASE("Samples of an independent density keep it independent", "[rules][pose][law]") {
  for (unsigned seed = 0; seed < 20; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto x = BinghamGaussian<double>::independent(random_bingham<double, 4>(rng, -1.0, 3.0),
                                                        random_matrix<double, 3, 1>(rng),
                                                        random_covariance<double, 3>(rng));
    const double smallest = x.orientation_offset_variances().minCoeff();
    const auto check = [&](const BinghamGaussian<double>& matched) {
      CHECK(max_difference(smallest * matched.coupling(), Matrix3<double>::Zero()) <= 100 * kEpsilon<double>);
    };
    check(moment_match(sample(PaperPoseRule{}, x)));
    check(moment_match(sample(RichPoseRule{}, x)));
    check(moment_match(sample(JointPoseRule{}, x)));
  }
}

TEST_CASE("Samples move with the frame", "[rules][pose][law]") {
  // Up to the order and the signs of axes, which the rules do not depend on.
  for (unsigned seed = 0; seed < 20; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto x = random_bingham_gaussian<double>(rng, -1.0, 3.0);
    const auto y = random_pose<double>(rng);
    const auto moved = moment_match(sample(JointPoseRule{}, compose(y, x)));
    const auto expected = compose(y, moment_match(sample(JointPoseRule{}, x)));
    // The moments are solved for to 1e-13; as much again for the eigenvectors.
    CHECK(max_difference(moved.orientation().scatter(), expected.orientation().scatter()) <= 2e-13);
    CHECK(max_difference(moved.mean_translation(), expected.mean_translation()) <= 100 * kEpsilon<double>);
  }
}
