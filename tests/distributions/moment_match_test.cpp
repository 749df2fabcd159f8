// SPDX-License-Identifier: MIT
#include <cmath>
#include <limits>
#include <utility>

#include <antipode/detail/products.hpp>
#include <antipode/distributions/bingham_gaussian.hpp>
#include <antipode/sampling/pose_rules.hpp>

#include "distributions/random_densities.hpp"
#include "support/catch.hpp"
#include "support/error_message.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

constexpr int kCount = 24;

/// Poses about a random one, with random weights of any sum.
template <class Scalar>
WeightedSamples<Scalar, 8, kCount> random_samples(Rng& rng, double spread) {
  const auto centre = random_pose<Scalar>(rng);
  WeightedSamples<Scalar, 8, kCount> samples;
  for (int k = 0; k < kCount; ++k) {
    samples.points.col(k) = centre.boxplus(random_matrix<Scalar, 6, 1>(rng, spread)).coeffs();
    samples.weights[k] = uniform<Scalar>(rng, 0.1, 2.0);
  }
  return samples;
}

template <class Scalar, int Count>
void flip_random_signs(Rng& rng, WeightedSamples<Scalar, 8, Count>& samples) {
  for (int k = 0; k < Count; ++k) {
    if (rng() % 2) samples.points.col(k) *= Scalar(-1);
  }
}

template <class Scalar>
void check_same(const BinghamGaussian<Scalar>& x, const BinghamGaussian<Scalar>& y, double tolerance) {
  CHECK(max_difference(x.orientation().scatter(), y.orientation().scatter()) <= tolerance);
  CHECK(max_difference(x.mean_translation(), y.mean_translation()) <= tolerance);
  CHECK(max_difference(x.conditional_covariance(), y.conditional_covariance()) <= tolerance);
  const Vector4<Scalar> q = x.orientation().axes() * Vector4<Scalar>(0.1, 0.2, -0.3, 0.9).normalized();
  CHECK(max_difference(x.conditional_mean(q), y.conditional_mean(q)) <= tolerance);
}

}  // namespace

TEST_CASE("Samples of a density are matched by that density, whatever their signs", "[pose][match][law]") {
  for (unsigned seed = 0; seed < 100; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const BinghamGaussian<double> x(random_bingham<double, 4>(rng, 0.0, 1.5),
                                    random_matrix<double, 3, 1>(rng), random_matrix<double, 3>(rng),
                                    0.3 * random_covariance<double, 3>(rng));
    auto samples = sample(RichPoseRule{}, x);
    flip_random_signs(rng, samples);
    // Sums of 225 products of order one: rounding grows like sqrt(225) epsilon; G and Sc divide by T > 0.02.
    check_same(moment_match(samples), x, 2e-13);
  }
}

TEMPLATE_TEST_CASE("The moments of any samples are kept", "[pose][match][law]", float, double) {
  for (unsigned seed = 0; seed < 60; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto samples = random_samples<TestType>(rng, 0.8);
    const auto x = moment_match(samples);
    const TestType sum = samples.weights.sum();
    Matrix4<TestType> scatter = Matrix4<TestType>::Zero();
    Vector3<TestType> mean_tau = Vector3<TestType>::Zero(), mean_t = Vector3<TestType>::Zero();
    Matrix3<TestType> tau_tau = Matrix3<TestType>::Zero(), t_tau = tau_tau, t_t = tau_tau;
    for (int k = 0; k < kCount; ++k) {
      const auto pose = DualQuaternion<TestType>::unchecked(samples.points.col(k));
      const TestType weight = samples.weights[k] / sum;
      const Vector4<TestType> q = pose.rotation();
      const Vector3<TestType> tau = x.orientation_offset(q);
      const Vector3<TestType> t = pose.translation() - x.mean_translation();
      mean_tau += weight * tau;
      mean_t += weight * t;
      detail::add_outer_product(weight, q, q, scatter);
      detail::add_outer_product(weight, tau, tau, tau_tau);
      detail::add_outer_product(weight, t, tau, t_tau);
      detail::add_outer_product(weight, t, t, t_t);
    }
    const double tolerance = 300 * kEpsilon<TestType>;
    const Matrix3<TestType>& G = x.coupling();
    const Matrix3<TestType> explained = detail::congruence<TestType, 3, 3>(G, tau_tau);
    const Matrix3<TestType> covariance = x.conditional_covariance() + explained;
    CHECK(max_difference(x.orientation().scatter(), scatter) <= tolerance + 1e-13);
    CHECK(max_difference(mean_tau, Vector3<TestType>::Zero()) <= tolerance);
    CHECK(max_difference(mean_t, Vector3<TestType>::Zero()) <= tolerance);
    CHECK(max_difference(G * tau_tau, t_tau) <= tolerance);
    CHECK(max_difference(covariance, t_t) <= 3 * tolerance);
  }
}

TEMPLATE_TEST_CASE("Signs, order and scale of the weights do not matter", "[pose][match][law]", float,
                   double) {
  for (unsigned seed = 0; seed < 30; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto samples = random_samples<TestType>(rng, 0.8);
    auto other = samples;
    flip_random_signs(rng, other);
    for (int k = 0; k < kCount / 2; ++k) {
      other.points.col(k).swap(other.points.col(kCount - 1 - k));
      std::swap(other.weights[k], other.weights[kCount - 1 - k]);
    }
    other.weights *= TestType(1e3);
    check_same(moment_match(other), moment_match(samples), 2e3 * kEpsilon<TestType>);
  }
}

TEMPLATE_TEST_CASE("Without the coupling the translation keeps its covariance", "[pose][match]", float,
                   double) {
  Rng rng(1);
  const auto samples = random_samples<TestType>(rng, 0.8);
  const auto coupled = moment_match(samples);
  const auto independent = moment_match(samples, {.keep_coupling = false});
  CHECK(max_difference(independent.coupling(), Matrix3<TestType>::Zero()) == 0.0);
  CHECK(max_difference(independent.mean_translation(), coupled.mean_translation()) == 0.0);
  const Matrix3<TestType> explained = independent.conditional_covariance() - coupled.conditional_covariance();
  CHECK(static_cast<double>(detail::symmetric_eigen(explained).values[0]) >= -20 * kEpsilon<TestType>);
}

TEMPLATE_TEST_CASE("Weightless samples are ignored", "[pose][match]", float, double) {
  Rng rng(2);
  auto samples = random_samples<TestType>(rng, 0.5);
  samples.weights.template tail<4>().setZero();
  const auto expected = moment_match(samples.points.template leftCols<kCount - 4>(),
                                     samples.weights.template head<kCount - 4>());
  samples.points.template rightCols<4>() *= TestType(-1);
  check_same(moment_match(samples), expected, 100 * kEpsilon<TestType>);
}

TEMPLATE_TEST_CASE("A single pose is matched by the most certain density", "[pose][match]", float, double) {
  Rng rng(3);
  const auto pose = random_pose<TestType>(rng);
  const auto x = moment_match(pose.coeffs(), Vector<TestType, 1>(TestType(3)));
  CHECK(x.pose().is_approx(pose, static_cast<TestType>(10 * kEpsilon<TestType>)));
  CHECK(max_difference(x.conditional_covariance(), Matrix3<TestType>::Zero()) == 0.0);
  CHECK(max_difference(x.coupling(), Matrix3<TestType>::Zero()) == 0.0);
  CHECK(static_cast<double>(x.orientation().second_moments()[2]) <=
        std::max(5.1e-9, 1.1 * kEpsilon<TestType>));
}

TEST_CASE("The smallest second moment can be chosen", "[pose][match]") {
  const auto x = moment_match(DualQuaternion<double>::identity().coeffs(), Vector<double, 1>(1.0),
                              {.min_eigenvalue = 1e-4});
  CHECK(x.orientation().second_moments()[0] == Approx(1e-4 / (1.0 + 3e-4)).epsilon(1e-12));
}

TEST_CASE("Samples of dynamic size are matched as well", "[pose][match]") {
  Rng rng(4);
  const auto samples = random_samples<double>(rng, 0.5);
  const Eigen::Matrix<double, 8, Eigen::Dynamic> points = samples.points;
  const Eigen::VectorXd weights = samples.weights;
  check_same(moment_match(points, weights), moment_match(samples), 1e-15);
}

TEMPLATE_TEST_CASE("Samples without moments are refused", "[pose][match][error]", float, double) {
  Rng rng(5);
  const auto samples = random_samples<TestType>(rng, 0.5);
  const auto with_weight = [&](TestType w) {
    auto changed = samples;
    changed.weights[2] = w;
    return error_message([&] { return moment_match(changed); });
  };
  constexpr TestType kNan = std::numeric_limits<TestType>::quiet_NaN();
  constexpr TestType kInfinity = std::numeric_limits<TestType>::infinity();
  CHECK(with_weight(TestType(0)) == "nothing thrown");
  CHECK(contains(with_weight(TestType(-0.5)), "-0.5"));
  CHECK(contains(with_weight(kNan), "weights are not finite"));
  CHECK(contains(with_weight(kInfinity), "weights are not finite"));
  CHECK(contains(
      error_message([&] { return moment_match(samples.points, Vector<TestType, kCount>::Zero().eval()); }),
      "positive sum"));
  CHECK(contains(error_message([&] {
                   return moment_match(samples.points, samples.weights.template head<kCount - 4>());
                 }),
                 "one weight per sample; number of weights: 20"));
  CHECK(contains(error_message([&] {
                   return moment_match(samples.points.template leftCols<0>(),
                                       samples.weights.template head<0>());
                 }),
                 "positive sum"));
  for (const int row : {0, 5}) {
    auto changed = samples;
    changed.points(row, 1) = kNan;
    CHECK(contains(error_message([&] { return moment_match(changed); }), "not finite"));
  }
  auto scaled = samples;
  scaled.points *= TestType(1.01);
  CHECK(contains(error_message([&] { return moment_match(scaled); }), "do not sum to one"));
}
