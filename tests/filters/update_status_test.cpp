// SPDX-License-Identifier: MIT
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include <antipode/filters/detail/mode_search.hpp>
#include <antipode/filters/gauss_newton_update.hpp>
#include <antipode/filters/gaussian_measurements.hpp>
#include <antipode/filters/linearized_update.hpp>
#include <antipode/filters/progressive_update.hpp>
#include <antipode/filters/quadratic_update.hpp>
#include <antipode/filters/update_status.hpp>

#include "filters/models.hpp"
#include "support/catch.hpp"
#include "support/error_message.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

using Pose = DualQuaternion<double>;
using Likelihood = AnyLogLikelihood<double>;

[[nodiscard]] auto quadratic(const PoseGaussian<double>& prior, const Likelihood& l,
                             const QuadraticUpdateOptions<double>& options = {}) {
  return quadratic_update(prior, l, options);
}
[[nodiscard]] auto progressive(const PoseGaussian<double>& prior, const Likelihood& l,
                               const ProgressiveOptions<double>& options = {}) {
  return progressive_update(to_bingham_gaussian(prior), l, JointPoseRule{}, options);
}

/// A measured position coordinate or range, by its model.
using ScalarModel = std::function<Vector<double, 1>(const Pose&, std::size_t)>;
[[nodiscard]] auto linearized(const PoseGaussian<double>& prior, double z, double sigma, const ScalarModel& h,
                              const LinearizedUpdateOptions<double>& options = {}) {
  const std::vector<NoisyMeasurement<double, 1>> measurements{
      {Vector<double, 1>(z), Vector<double, 1>(sigma * sigma)}};
  return linearized_update(prior, measurements, h, options);
}

[[nodiscard]] PoseGaussian<double> around_origin(double rotation_sigma_rad, double translation_sigma_m) {
  return {Pose::identity(), pose_covariance<double>(rotation_sigma_rad, translation_sigma_m)};
}

[[nodiscard]] double bimodal(const Pose& x) {
  const double t = x.translation()[0];
  const double right = -0.5 * std::pow((t - 0.2) / 0.03, 2), left = -0.5 * std::pow((t + 0.2) / 0.03, 2);
  return std::max(left, right) + std::log1p(std::exp(-std::abs(left - right)));
}

}  // namespace

TEST_CASE("Two modes are reported, not merged in silence", "[status]") {
  const auto prior = around_origin(0.1, 0.2);
  const auto result = progressive(prior, bimodal);
  CHECK(result.status == UpdateStatus::kNotGaussian);
  CHECK(result.residual > 100.0);
  CHECK(quadratic(prior, bimodal).status != UpdateStatus::kConverged);
}

TEST_CASE("A position known up to its sign is reported by every update that sees one place", "[status]") {
  // |t_x| = 5 +- .5 under priors of 2 to 100 m. From one side the measurement looks linear.
  struct Distance {
    Vector<double, 1> operator()(const Pose& x, std::size_t) const {
      return Vector<double, 1>(std::abs(x.translation()[0]));
    }
    Vector<double, 1> operator()(const Pose& x, std::size_t i, Matrix<double, 1, 6>& J) const {
      J.setZero();
      J(0, 3) = x.translation()[0] > 0.0 ? 1.0 : -1.0;
      return (*this)(x, i);
    }
  };
  const std::vector<NoisyMeasurement<double, 1>> z{{Vector<double, 1>(5.0), Vector<double, 1>(0.25)}};
  const GaussianMeasurements measurement(z, Distance{});
  for (const double sigma_m : {4.0, 10.0, 100.0}) {
    for (const double offset_m : {0.5, 2.0, -3.0}) {
      CAPTURE(sigma_m, offset_m);
      const auto at =
          Pose::from_rotation_translation(Vector4<double>(1, 0, 0, 0), Vector3<double>(offset_m, 0, 0));
      const SplitPoseGaussian<double> prior{at, pose_covariance<double>(0.17, sigma_m)};
      CHECK(quadratic_update(prior, measurement).status != UpdateStatus::kConverged);
      CHECK(linearized_update(prior, z, Distance{}, {}, MysovskikhRule<6>{}).status !=
            UpdateStatus::kConverged);
      CHECK(gauss_newton_update(prior, z, Distance{}).status != UpdateStatus::kConverged);
    }
  }
  // Known to a metre, it is at one of the two. Who knows better may say so.
  const auto near = Pose::from_rotation_translation(Vector4<double>(1, 0, 0, 0), Vector3<double>(4.5, 0, 0));
  const SplitPoseGaussian<double> decided{near, pose_covariance<double>(0.17, 1.0)};
  CHECK(quadratic_update(decided, measurement).status == UpdateStatus::kConverged);
  CHECK(linearized_update(decided, z, Distance{}).status == UpdateStatus::kConverged);
  CHECK(gauss_newton_update(decided, z, Distance{}).status == UpdateStatus::kConverged);
  const SplitPoseGaussian<double> wide{near, pose_covariance<double>(0.17, 10.0)};
  CHECK(gauss_newton_update(wide, z, Distance{}, {.check_modes = false}).status == UpdateStatus::kConverged);
}

TEST_CASE("A second place is seen under a prior a thousand times as wide, far off and near", "[status]") {
  // |t_x| = z +- 3 cm, +- 100 m: beside such a prior a small z makes the measurement nearly quadratic.
  const ScalarModel distance = [](const Pose& x, std::size_t) {
    return Vector<double, 1>(std::abs(x.translation()[0]));
  };
  struct WithJacobian {
    ScalarModel values;
    Vector<double, 1> operator()(const Pose& x, std::size_t i) const { return values(x, i); }
    Vector<double, 1> operator()(const Pose& x, std::size_t i, Matrix<double, 1, 6>& J) const {
      J.setZero();
      J(0, 3) = x.translation()[0] > 0.0 ? 1.0 : -1.0;
      return values(x, i);
    }
  };
  for (const double z : {0.5, 2.7, 2.9, 3.4, 33.8, 106.0}) {
    for (const double prior_m : {0.005, 0.3, 2.3, -3.3}) {
      CAPTURE(z, prior_m);
      const auto at =
          Pose::from_rotation_translation(Vector4<double>(1, 0, 0, 0), Vector3<double>(prior_m, 0, 0));
      const SplitPoseGaussian<double> prior{at, pose_covariance<double>(0.17, 100.0)};
      const std::vector<NoisyMeasurement<double, 1>> measured{
          {Vector<double, 1>(z), Vector<double, 1>(0.03 * 0.03)}};
      const GaussianMeasurements likelihood(measured, distance);
      CHECK(quadratic_update(prior, likelihood).status != UpdateStatus::kConverged);
      CHECK(linearized_update(prior, measured, distance, {}, MysovskikhRule<6>{}).status !=
            UpdateStatus::kConverged);
      CHECK(gauss_newton_update(prior, measured, WithJacobian{distance}).status != UpdateStatus::kConverged);
    }
  }
}

TEST_CASE("A second mode is found wherever it is on the axis, and one alone is not doubted", "[status]") {
  const SplitPoseGaussian<double> prior{Pose::identity(), pose_covariance<double>(0.1, 1.0)};
  const auto two = [](double x, double first, double second, double sigma) {
    const double a = -0.5 * std::pow((x - first) / sigma, 2), b = -0.5 * std::pow((x - second) / sigma, 2);
    return std::max(a, b) + std::log1p(std::exp(-std::abs(a - b)));
  };
  for (const double sigma : {1e-3, 1e-2, 0.05}) {
    for (const double second : {-1.5, -0.5, 1.2, 2.0}) {
      CAPTURE(sigma, second);
      const auto origin = detail::SqrtGaussian<SplitPoseGaussian<double>>::of(prior);
      const SplitPoseGaussian<double> first{
          Pose::from_rotation_translation(Vector4<double>(1, 0, 0, 0), Vector3<double>(0.3, 0, 0)),
          Vector6<double>(0.01, 0.01, 0.01, sigma * sigma, 1.0, 1.0).asDiagonal()};
      const auto posterior = detail::SqrtGaussian<SplitPoseGaussian<double>>::of(first).seen_from(origin);
      const auto search = [&](double other) {
        const auto nowhere = [](const auto&) { return std::optional<detail::LocalModel<double, 6>>(); };
        return detail::has_second_mode<57>(
            origin, posterior, {0.0},
            [&](const Matrix<double, 6, 57>& tangents, Vector<double, 57>& values) {
              for (int k = 0; k < 57; ++k) values[k] = two(0.3 + tangents(3, k), 0.3, other, sigma);
            },
            nowhere);
      };
      CHECK(search(second));
      CHECK_FALSE(search(0.3));
      CHECK_FALSE(search(9.0));  // beyond what the prior allows
    }
  }
}

TEST_CASE("A density that collapsed to its floors has diverged", "[status]") {
  const auto prior = around_origin(0.1, 0.2);
  const Likelihood collapsing[] = {
      [](const Pose& x) { return -0.5e12 * x.log().squaredNorm(); },  // a needle of 1e-6
      [](const Pose& x) { return -1e300 * x.translation().squaredNorm(); },
  };
  for (const Likelihood& l : collapsing) {
    CHECK(progressive(prior, l, {.max_steps = 100}).status == UpdateStatus::kDiverged);
  }
  const Likelihood cliff = [](const Pose& x) { return 1e6 * x.translation()[0]; };
  CHECK(progressive(prior, cliff, {.max_steps = 100}).status != UpdateStatus::kConverged);
}

TEST_CASE("A position measured in the screw chart under a wide attitude is not called converged",
          "[status]") {
  constexpr double kDegree = 3.14159265358979 / 180.0;
  int overconfident = 0;
  for (unsigned seed = 0; seed < 300; ++seed) {
    Rng rng(seed);
    std::normal_distribution<double> noise(0.0, 0.1);
    const SplitPoseGaussian<double> density{random_pose<double>(rng),
                                            pose_covariance<double>(10 * kDegree, 10)};
    const PoseGaussian<double> prior{density.pose, density.covariance};
    const auto truth = draw(rng, density);
    const double z = truth.translation()[2] + noise(rng);
    const auto result =
        quadratic(prior, [&](const Pose& x) { return -50.0 * std::pow(x.translation()[2] - z, 2); });
    overconfident += result.status == UpdateStatus::kConverged && nees(result.posterior, truth) > 30.0;
  }
  CHECK(overconfident <= 1);
}

TEST_CASE("The residual is that over the posterior, and the options say how much of it passes", "[status]") {
  const auto prior = around_origin(0.17, 2.0);
  const Likelihood range = [](const Pose& x) {
    return -0.5 * std::pow(((x.translation() - Vector3<double>(30, 10, 5)).norm() - 32.0) / 0.05, 2);
  };
  const auto strict = quadratic(prior, range);
  CHECK(strict.status != UpdateStatus::kConverged);
  CHECK(strict.residual > 0.4);
  if (strict.status == UpdateStatus::kNotGaussian) {
    const auto lenient =
        quadratic(prior, range, {.max_final_residual = std::numeric_limits<double>::infinity()});
    CHECK(lenient.status == UpdateStatus::kConverged);
    CHECK(lenient.posterior.covariance == strict.posterior.covariance);
  }
  CHECK(contains(error_message([&] { (void)quadratic(prior, range, {.max_final_residual = -1.0}); }),
                 "max_final_residual is not positive: -1"));
  CHECK(contains(error_message([&] { (void)progressive(prior, range, {.max_final_residual = 0.0}); }),
                 "max_final_residual is not positive: 0"));
}

TEST_CASE("Linear models say when they do not hold or have not settled", "[status]") {
  const ScalarModel range = [](const Pose& x, std::size_t) {
    return Vector<double, 1>((x.translation() - Vector3<double>(30, 10, 5)).norm());
  };
  CHECK(linearized(around_origin(0.1, 0.1), 32.0, 0.5, range).status == UpdateStatus::kConverged);
  const auto curved = linearized(around_origin(0.1, 10.0), 32.0, 0.05, range);
  CHECK(curved.residual > 4.0);
  CHECK(curved.status == UpdateStatus::kNotGaussian);
  const auto bent = linearized(around_origin(0.1, 2.0), 32.0, 0.05, range);
  CHECK(bent.residual > 2.0);
  CHECK(bent.status == UpdateStatus::kNotGaussian);
  const auto accepted = linearized(around_origin(0.1, 10.0), 32.0, 0.05, range,
                                   {.max_final_residual = std::numeric_limits<double>::infinity()});
  CHECK(accepted.status == UpdateStatus::kConverged);
  const auto hopeless = linearized(around_origin(0.1, 1e6), 32.0, 0.05, range);
  CHECK(hopeless.status != UpdateStatus::kConverged);
  CHECK(linearized(around_origin(0.1, 0.1), 34.0, 0.01, range, {.max_iterations = 1}).status ==
        UpdateStatus::kDiverged);
}

TEST_CASE("The evidence is right for measurements a million million times sharper than the prior",
          "[status]") {
  for (const double ratio : {1e6, 5e7, 1e9, 1e12}) {
    CAPTURE(ratio);
    const SplitPoseGaussian<double> prior{Pose::identity(), pose_covariance<double>(0.1, 0.2)};
    const double sigma = 0.2 / ratio;
    const auto result = quadratic_update(prior, [=](const Pose& x) {
      const double error = (x.translation()[2] - 0.1) / sigma;
      return -0.5 * error * error;
    });
    CHECK(result.status == UpdateStatus::kConverged);
    const double S = 0.04 + sigma * sigma;
    CHECK(result.log_evidence == Approx(-0.005 / S - std::log(std::sqrt(S) / sigma)).margin(1e-3));
    const std::vector<NoisyMeasurement<double, 1>> measurements{
        {Vector<double, 1>(0.1), Vector<double, 1>(sigma * sigma)}};
    const auto linear = linearized_update(prior, measurements, [](const Pose& x, std::size_t) {
      return Vector<double, 1>(x.translation()[2]);
    });
    CHECK(linear.log_evidence == Approx(result.log_evidence).margin(1e-3));
  }
}

TEST_CASE("What is too large to compute with is never called converged", "[status]") {
  const auto honest = [](const auto& result) {
    if (result.status != UpdateStatus::kConverged) return true;
    return std::isfinite(result.log_evidence) && std::isfinite(result.residual) &&
           detail::cholesky_factor<double, 6>(result.posterior.covariance).has_value();
  };
  const auto prior = around_origin(0.1, 1.0);
  for (int exponent = 100; exponent <= 308; exponent += 4) {
    const double steep = std::pow(10.0, exponent);
    CAPTURE(exponent);
    CHECK(honest(quadratic(prior, [&](const Pose& x) { return -steep * x.translation().squaredNorm(); })));
    CHECK(honest(quadratic(prior, [&](const Pose& x) { return steep * x.translation()[0]; })));
    CHECK(honest(quadratic(prior, [&](const Pose& x) { return -steep * std::abs(x.translation()[0]); })));
    // A constant at the mean, and anything beside it: only the residual over the posterior tells.
    const auto h = [&](const Pose& x, std::size_t, Matrix<double, 2, 6>& J) {
      J.setZero();
      const double t = x.translation()[0];
      return Vector<double, 2>(t == 0.0 ? 0.0 : std::copysign(steep, t), steep * t * t);
    };
    const std::vector<NoisyMeasurement<double, 2>> z{
        {Vector<double, 2>::Zero(), (Matrix<double, 2>() << 1.0, 0.5, 0.5, 1.0).finished()}};
    const auto result = gauss_newton_update(prior, z, h);
    CHECK(honest(result));
    CHECK(result.status != UpdateStatus::kConverged);
  }
}

TEST_CASE("A twist that overflows is not called infinite", "[status][error]") {
  Vector6<double> xi = Vector6<double>::Zero();
  xi[0] = 1e200;
  CHECK(error_message([&] { (void)Pose::exp(xi); }).starts_with("twist (phi, rho) is too large"));
  xi[0] = std::numeric_limits<double>::infinity();
  CHECK(error_message([&] { (void)Pose::exp(xi); }).starts_with("twist (phi, rho) is not finite"));
}
