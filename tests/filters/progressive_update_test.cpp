// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <type_traits>

#include <antipode/detail/cholesky.hpp>
#include <antipode/detail/products.hpp>
#include <antipode/detail/solve.hpp>
#include <antipode/filters/progressive_update.hpp>
#include <antipode/filters/update_status.hpp>

#include "filters/models.hpp"
#include "support/catch.hpp"
#include "support/error_message.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// A prior around a random pose, with no two standard deviations alike (the axes would be arbitrary).
template <class Scalar>
[[nodiscard]] PoseGaussian<Scalar> random_pose_gaussian(Rng& rng, double rotation_sigma_rad,
                                                        double translation_sigma_m) {
  const auto sigma = [&](int i) {
    return static_cast<Scalar>(i < 3 ? rotation_sigma_rad : translation_sigma_m);
  };
  Matrix6<Scalar> P = random_covariance<Scalar, 6>(rng, 0.2);
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) P(i, j) *= sigma(i) * sigma(j);
  }
  return {random_pose<Scalar>(rng), P};
}
template <class Scalar>
[[nodiscard]] BinghamGaussian<Scalar> random_prior(Rng& rng, double rotation_sigma_rad,
                                                   double translation_sigma_m) {
  return to_bingham_gaussian(random_pose_gaussian<Scalar>(rng, rotation_sigma_rad, translation_sigma_m));
}

/// A smooth likelihood of order one around the prior.
template <class Scalar>
struct SmoothLikelihood {
  DualQuaternion<Scalar> target;
  Matrix6<Scalar> information;

  [[nodiscard]] Scalar operator()(const DualQuaternion<Scalar>& x) const {
    const Vector6<Scalar> error = x.boxminus(target);
    return Scalar(-0.5) * error.dot(information * error);
  }
  [[nodiscard]] static SmoothLikelihood around(Rng& rng, const BinghamGaussian<Scalar>& prior) {
    const PoseGaussian<Scalar> density = to_pose_gaussian(prior);
    const DualQuaternion<Scalar> target = draw(rng, density);
    const Matrix6<Scalar> information =
        detail::solve<Scalar, 6, 6>(density.covariance, Matrix6<Scalar>::Identity());
    return {target, uniform<Scalar>(rng, 0.5, 20.0) * information};
  }
};

template <class Scalar>
[[nodiscard]] bool same_density(const BinghamGaussian<Scalar>& a, const BinghamGaussian<Scalar>& b,
                                double tolerance) {
  const Matrix6<Scalar> P = a.covariance(), Q = b.covariance();
  const Vector6<Scalar> error = b.pose().boxminus(a.pose());
  double mean_error = 0.0, covariance_error = 0.0;
  for (int i = 0; i < 6; ++i) {
    mean_error = std::max(mean_error, static_cast<double>(std::abs(error[i]) / std::sqrt(P(i, i))));
    for (int j = 0; j < 6; ++j) {
      const Scalar relative = std::abs(Q(i, j) - P(i, j)) / std::sqrt(P(i, i) * P(j, j));
      covariance_error = std::max(covariance_error, static_cast<double>(relative));
    }
  }
  CAPTURE(mean_error, covariance_error, tolerance);
  CHECK(mean_error <= tolerance);
  CHECK(covariance_error <= tolerance);
  return mean_error <= tolerance && covariance_error <= tolerance;
}

/// progressive_update, compiled once for each scalar and rule.
template <class Scalar, class Rule>
[[nodiscard]] ProgressiveResult<Scalar> update(
    const BinghamGaussian<Scalar>& prior,
    const std::type_identity_t<AnyLogLikelihood<Scalar>>& log_likelihood, const Rule& rule,
    const std::type_identity_t<ProgressiveOptions<Scalar>>& options = {}) {
  return progressive_update(prior, log_likelihood, rule, options);
}

}  // namespace

TEMPLATE_TEST_CASE("A constant likelihood returns the prior in one step", "[progressive][law]", float,
                   double) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto prior = random_prior<TestType>(rng, 0.2, 1.0);
    const auto constant = [](const DualQuaternion<TestType>&) { return TestType(-3); };
    const auto result = update(prior, constant, JointPoseRule{});
    CHECK(result.status == UpdateStatus::kConverged);
    CHECK(result.steps == 1);
    CHECK(result.evaluations == 2 * JointPoseRule::kCount);  // one step, and the check of the posterior
    CHECK(std::abs(static_cast<double>(result.log_evidence) + 3.0) <= 20 * kEpsilon<TestType>);
    CHECK(static_cast<double>(result.effective_sample_size) ==
          Approx(JointPoseRule::kCount).epsilon(100 * kEpsilon<TestType>));
    // The rotation's moments are 0.01 of a scatter matrix with unit trace.
    CHECK(same_density(prior, result.posterior, 1e4 * kEpsilon<TestType>));
  }
}

TEMPLATE_TEST_CASE("Exchanging q and -q in any input changes nothing", "[progressive][law]", float, double) {
  for (unsigned seed = 0; seed < 10; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto prior = random_pose_gaussian<TestType>(rng, 0.1, 0.5);
    const auto density = to_bingham_gaussian(prior);
    const auto likelihood = SmoothLikelihood<TestType>::around(rng, density);
    const SmoothLikelihood<TestType> antipodal{antipode_of(likelihood.target), likelihood.information};
    const auto a = update(density, likelihood, JointPoseRule{});
    const PoseGaussian<TestType> antipodal_prior{antipode_of(prior.pose), prior.covariance};
    const auto b = update(to_bingham_gaussian(antipodal_prior), antipodal, JointPoseRule{});
    CHECK(max_difference(a.posterior.mean_translation(), b.posterior.mean_translation()) == 0.0);
    CHECK(max_difference(a.posterior.covariance(), b.posterior.covariance()) == 0.0);
    CHECK(a.log_evidence == b.log_evidence);
  }
}

TEST_CASE("The sign of the mode alone changes nothing either", "[progressive][law]") {
  for (unsigned seed = 0; seed < 10; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto prior = random_prior<double>(rng, 0.1, 0.5);
    const auto likelihood = SmoothLikelihood<double>::around(rng, prior);
    // The samples of a Cartesian rule are the same in another order.
    const auto a = update(prior, likelihood, RichPoseRule{});
    const auto b = update(antipode_of(prior), likelihood, RichPoseRule{});
    // In each of ~40 steps sums round moments of 1e-4 in a scatter matrix of trace one.
    CHECK(same_density(a.posterior, b.posterior, 4e5 * kEpsilon<double>));
  }
}

TEST_CASE("Moving the origin moves the posterior", "[progressive][law]") {
  for (unsigned seed = 0; seed < 10; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto prior = random_prior<double>(rng, 0.1, 0.5);
    const auto likelihood = SmoothLikelihood<double>::around(rng, prior);
    // No rotation: the sigma points of a turned covariance are others.
    const auto y = DualQuaternion<double>::from_rotation_translation(Vector4<double>(1.0, 0.0, 0.0, 0.0),
                                                                     random_matrix<double, 3, 1>(rng, 100.0));
    const auto moved = [&](const DualQuaternion<double>& x) { return likelihood(y.inverse() * x); };
    const auto a = update(prior, likelihood, RichPoseRule{});
    const auto b = update(compose(y, prior), moved, RichPoseRule{});
    CHECK(same_density(compose(y, a.posterior), b.posterior, 1e-8));
    CHECK(std::abs(a.log_evidence - b.log_evidence) <= 1e-8);
  }
}

TEMPLATE_TEST_CASE("A batched likelihood gives the same bits as one pose at a time", "[progressive][law]",
                   float, double) {
  Rng rng(1);
  const auto prior = random_prior<TestType>(rng, 0.1, 0.5);
  const auto likelihood = SmoothLikelihood<TestType>::around(rng, prior);
  using Poses = Eigen::Ref<const Matrix<TestType, 8, Eigen::Dynamic>>;
  using Values = Eigen::Ref<Vector<TestType, Eigen::Dynamic>>;
  const auto batched = [&](const Poses& poses, Values values) {
    for (Eigen::Index k = 0; k < poses.cols(); ++k)
      values[k] = likelihood(DualQuaternion<TestType>::unchecked(poses.col(k)));
  };
  const auto a = update(prior, likelihood, JointPoseRule{});
  const auto b = progressive_update(prior, batched, JointPoseRule{});
  CHECK(a.log_evidence == b.log_evidence);
  CHECK(max_difference(a.posterior.mean_translation(), b.posterior.mean_translation()) == 0.0);
  CHECK(max_difference(a.posterior.covariance(), b.posterior.covariance()) == 0.0);
}

TEST_CASE("A linear measurement of the translation converges to the Kalman update", "[progressive]") {
  for (unsigned seed = 0; seed < 5; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const Matrix3<double> P = random_covariance<double, 3>(rng, 0.1);
    const Matrix3<double> R = random_covariance<double, 3>(rng, 0.1);
    const Matrix3<double> H = Matrix3<double>::Identity() + random_matrix<double, 3>(rng, 0.3);
    const auto prior = BinghamGaussian<double>::independent(random_prior<double>(rng, 0.1, 1.0).orientation(),
                                                            random_matrix<double, 3, 1>(rng), P);
    const Vector3<double> innovation = random_matrix<double, 3, 1>(rng);
    const Vector3<double> z = H * prior.mean_translation() + innovation;
    const Matrix3<double> R_root = detail::cholesky_factor(R).value();
    const auto likelihood = [&](const DualQuaternion<double>& x) {
      const Vector3<double> error = z - H * x.translation();
      return -0.5 * detail::solve_lower(R_root, error).squaredNorm();
    };
    // With S = C C^T and W = C^-1 H P the mean moves by W^T C^-1 (z - H mu), the covariance shrinks by W^T W.
    const Matrix3<double> S = detail::congruence<double, 3, 3>(H, P) + R;
    const Matrix3<double> C = detail::cholesky_factor(S).value();
    const Matrix3<double> gain = detail::solve_lower<double, 3, 3>(C, H * P).transpose();
    const Vector3<double> whitened = detail::solve_lower(C, innovation);
    const Vector3<double> mean = prior.mean_translation() + gain * whitened;
    const Matrix3<double> covariance = P - detail::scaled_square<double, 3, 3>(gain, Vector3<double>::Ones());
    double evidence = -0.5 * whitened.squaredNorm();
    for (int i = 0; i < 3; ++i) evidence -= std::log(C(i, i) / R_root(i, i));

    const auto result = update(prior, likelihood, RichPoseRule{}, {.tau = 0.98});
    const auto& posterior = result.posterior;
    for (int i = 0; i < 3; ++i) {
      CHECK(std::abs(posterior.mean_translation()[i] - mean[i]) <= 0.01 * std::sqrt(covariance(i, i)));
    }
    CHECK(max_difference(posterior.translation_covariance(), covariance) <= 0.01 * covariance.norm());
    CHECK(std::abs(result.log_evidence - evidence) <= 0.01);
    CHECK(max_difference(posterior.orientation().scatter(), prior.orientation().scatter()) <= 1e-9);
  }
}

TEMPLATE_TEST_CASE("tau bounds the effective sample size from below", "[progressive][law]", float, double) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    Rng rng(seed);
    const auto prior = random_prior<TestType>(rng, 0.1, 0.5);
    const auto likelihood = SmoothLikelihood<TestType>::around(rng, prior);
    const TestType tau = uniform<TestType>(rng, 0.05, 0.9);
    const auto result = update(prior, likelihood, JointPoseRule{}, {.tau = tau});
    CAPTURE(seed, tau, result.steps);
    REQUIRE_FALSE(result.step_floor_hit);
    // Kantorovich's inequality for factors within 1 : tau.
    const TestType bound = 4 * tau / ((1 + tau) * (1 + tau)) * JointPoseRule::kCount;
    CHECK(result.effective_sample_size >= bound * TestType(1 - 1e-4));
    CHECK(result.effective_sample_size <= JointPoseRule::kCount * TestType(1 + 1e-4));
    // One round of evaluations for the residual, and two to look for a second mode if the density shrank.
    CHECK(result.evaluations >= (result.steps + 1) * long{JointPoseRule::kCount});
    CHECK(result.evaluations <= (result.steps + 3) * long{JointPoseRule::kCount});
  }
}

TEST_CASE("The number of steps is bounded whatever tau asks for", "[progressive]") {
  Rng rng(2);
  const auto prior = random_prior<double>(rng, 0.1, 0.5);
  const auto likelihood = SmoothLikelihood<double>::around(rng, prior);
  for (int max_steps : {1, 2, 7, 10}) {
    CAPTURE(max_steps);
    const auto result = update(prior, likelihood, JointPoseRule{}, {.tau = 0.999999, .max_steps = max_steps});
    CHECK(result.steps == max_steps);
    CHECK(result.step_floor_hit);
    CHECK(result.status != UpdateStatus::kNotFinite);
  }
  const auto floored = update(prior, likelihood, JointPoseRule{}, {.tau = 0.999999, .min_step = 0.1});
  CHECK(floored.steps == 10);
  CHECK(floored.step_floor_hit);
}

TEST_CASE("Steps too long for the samples are repeated with shorter ones", "[progressive]") {
  Rng rng(3);
  const auto prior = random_prior<double>(rng, 0.3, 0.5);
  const auto sharp = [target = prior.pose()](const DualQuaternion<double>& x) {
    return -1e6 * x.boxminus(target).head<3>().squaredNorm();
  };
  const ProgressiveOptions<double> long_steps{.tau = 1e-100};
  const auto given_up = update(prior, sharp, JointPoseRule{}, {.tau = 1e-100, .max_restarts = 0});
  const auto result = update(prior, sharp, JointPoseRule{}, long_steps);
  CHECK(given_up.restarts == 0);
  CHECK(result.restarts > 0);
  CHECK(result.status != UpdateStatus::kDiverged);
  CHECK(result.evaluations > result.steps * long{JointPoseRule::kCount});
  const auto error = [](const auto& r) {
    return std::abs(std::log(r.posterior.orientation().second_moments()[0] * 4.0 * 2e6));
  };
  CHECK(error(result) < error(given_up));
}

TEST_CASE("An orientation below min_eigenvalue is reported", "[progressive]") {
  Rng rng(4);
  const auto prior = random_prior<double>(rng, 0.01, 0.5);
  const auto sharp = [target = prior.pose()](const DualQuaternion<double>& x) {
    return -1e9 * x.boxminus(target).head<3>().squaredNorm();
  };
  const auto floored = update(prior, sharp, JointPoseRule{}, {.min_eigenvalue = 1e-8});
  CHECK(floored.moment_floor_hit);
  CHECK(floored.posterior.orientation().second_moments()[0] == Approx(1e-8).epsilon(1e-5));
  const auto resolved = update(prior, sharp, JointPoseRule{}, {.min_eigenvalue = 1e-12});
  CHECK_FALSE(resolved.moment_floor_hit);
}

TEMPLATE_TEST_CASE("A likelihood that is not a number returns the prior and is reported", "[progressive]",
                   float, double) {
  Rng rng(5);
  const auto prior = random_prior<TestType>(rng, 0.1, 0.5);
  const auto smooth = SmoothLikelihood<TestType>::around(rng, prior);
  const auto check = [&](auto&& likelihood, UpdateStatus status) {
    const auto result = update(prior, likelihood, JointPoseRule{});
    CHECK(result.status == status);
    CHECK(max_difference(result.posterior.mean_translation(), prior.mean_translation()) == 0.0);
    CHECK(max_difference(result.posterior.covariance(), prior.covariance()) == 0.0);
  };
  constexpr TestType infinity = std::numeric_limits<TestType>::infinity();
  constexpr TestType nan = std::numeric_limits<TestType>::quiet_NaN();
  int calls = 0;
  check([&](const DualQuaternion<TestType>& x) { return ++calls == 5 ? nan : smooth(x); },
        UpdateStatus::kNotFinite);
  calls = 0;
  check([&](const DualQuaternion<TestType>& x) { return ++calls == 100 ? nan : smooth(x); },
        UpdateStatus::kNotFinite);
  calls = 0;
  check([&](const DualQuaternion<TestType>& x) { return ++calls == 5 ? infinity : smooth(x); },
        UpdateStatus::kNotFinite);
  check([&](const DualQuaternion<TestType>&) { return -infinity; }, UpdateStatus::kNoSupport);
  check([&](const DualQuaternion<TestType>&) { return nan; }, UpdateStatus::kNotFinite);
  constexpr TestType largest = std::numeric_limits<TestType>::max();
  calls = 0;
  check([&](const DualQuaternion<TestType>&) { return ++calls % 2 == 0 ? largest : -largest; },
        UpdateStatus::kNotFinite);
  check([&](const DualQuaternion<TestType>&) { return largest; }, UpdateStatus::kNotFinite);  // nis overflows
}

TEST_CASE("Poses that are impossible are excluded", "[progressive]") {
  Rng rng(6);
  const auto prior = random_prior<double>(rng, 0.1, 1.0);
  const double wall = prior.mean_translation()[0];
  const auto beyond_the_wall = [&](const DualQuaternion<double>& x) {
    return x.translation()[0] < wall - 0.5 ? -kInfinity : 0.0;
  };
  const auto result = update(prior, beyond_the_wall, RichPoseRule{}, {.tau = 0.8});
  CHECK(result.status == UpdateStatus::kNotGaussian);  // it is cut off at the wall
  // Samples do not resolve a jump; but the mean goes the right way and the variance shrinks.
  CHECK(result.posterior.mean_translation()[0] > wall);
  CHECK(result.posterior.mean_translation()[0] < wall + 1.0);
  CHECK(result.posterior.translation_covariance()(0, 0) < 1.0);
}

TEST_CASE("Landmarks behind some samples of a wide prior do not degrade the update in silence",
          "[progressive]") {
  constexpr double kSigma = 25.0 * std::numbers::pi / 180.0;
  for (unsigned seed = 0; seed < 10; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const PoseGaussian<double> prior{random_pose<double>(rng), pose_covariance<double>(kSigma, 2.0)};
    const auto truth = draw(rng, prior);
    auto scene = StereoScene<double>::random(rng, truth, 20);
    scene.behind = -kInfinity;
    const auto result = update(to_bingham_gaussian(prior), scene, RichPoseRule{}, {.tau = 0.8});
    CHECK(result.status == UpdateStatus::kConverged);
    CHECK(nees(to_pose_gaussian(result.posterior), truth) <= 30.0);
    // A pose that sees nothing is then likelier than one that sees all a little wrong, and the density may
    // collapse onto it. The status tells.
    scene.behind = -100.0;
    const auto lured = update(to_bingham_gaussian(prior), scene, RichPoseRule{}, {.tau = 0.8});
    const bool consistent = nees(to_pose_gaussian(lured.posterior), truth) <= 30.0;
    CHECK((lured.status != UpdateStatus::kConverged || consistent));
    CHECK(lured.posterior.covariance().allFinite());
  }
}

TEST_CASE("A posterior that does not explain the measurement is reported", "[progressive]") {
  Rng rng(7);
  const PoseGaussian<double> prior{random_pose<double>(rng), pose_covariance<double>(0.001, 0.01)};
  const auto scene = StereoScene<double>::random(rng, draw(rng, prior), 30);
  const double chi2_90_999 = 137.2;  // the 0.999 quantile for 90 residuals
  const ProgressiveOptions<double> options{.min_log_likelihood = -0.5 * chi2_90_999};
  CHECK(update(to_bingham_gaussian(prior), scene, RichPoseRule{}, options).status ==
        UpdateStatus::kConverged);
  auto wrong = scene;
  std::rotate(wrong.measurements.begin(), wrong.measurements.begin() + 1, wrong.measurements.end());
  const auto result = update(to_bingham_gaussian(prior), wrong, RichPoseRule{}, options);
  CHECK(result.status == UpdateStatus::kDiverged);
  CHECK(result.log_likelihood < options.min_log_likelihood);
}

TEST_CASE("Invalid options are refused with the value", "[progressive]") {
  const auto prior = to_bingham_gaussian(PoseGaussian<double>{{}, pose_covariance<double>(0.1, 1.0)});
  const auto message = [&](const ProgressiveOptions<double>& options) {
    return error_message([&] {
      return update(
                 prior, [](const DualQuaternion<double>&) { return 0.0; }, JointPoseRule{}, options)
          .steps;
    });
  };
  CHECK(contains(message({.tau = 1.0}), "tau is not inside (0, 1): 1"));
  CHECK(contains(message({.tau = 0.0}), "tau is not inside (0, 1): 0"));
  CHECK(contains(message({.tau = std::nan("")}), "tau is not inside (0, 1): nan"));
  CHECK(contains(message({.max_steps = 0}), "max_steps is not positive: 0"));
  CHECK(contains(message({.min_step = 1.5}), "min_step is not in [0, 1]: 1.5"));
  CHECK(contains(message({.min_eigenvalue = 0.3}), "min_eigenvalue is not in [1e-15, 1/4]: 0.3"));
  CHECK(contains(message({.max_restarts = -1}), "max_restarts is negative: -1"));
  CHECK(contains(message({.min_log_likelihood = std::nan("")}), "min_log_likelihood is not a number"));
}
