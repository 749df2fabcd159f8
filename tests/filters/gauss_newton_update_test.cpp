// SPDX-License-Identifier: MIT
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include <antipode/filters/gauss_newton_update.hpp>
#include <antipode/filters/linearized_update.hpp>
#include <antipode/filters/pose_filter.hpp>
#include <antipode/geometry/extended_pose.hpp>

#include "filters/models.hpp"
#include "support/catch.hpp"
#include "support/error_message.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

using Pose = DualQuaternion<double>;
using Point = Vector3<double>;
using Measurements = std::vector<NoisyMeasurement<double, 3>>;

}  // namespace

TEST_CASE("Gauss-Newton agrees with linearisation where that is exact", "[gauss-newton]") {
  for (unsigned seed = 0; seed < 20; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const PoseGaussian<double> prior{random_pose<double>(rng), pose_covariance<double>(0.03, 0.5)};
    const auto scene = StereoScene<double>::random(rng, draw(rng, prior), 30);
    const StereoWithJacobian h{scene.camera, scene.landmarks};
    const auto result = gauss_newton_update(prior, measurements_of(scene), h);
    const auto expected = linearized_update(prior, measurements_of(scene), [&](const Pose& x, std::size_t i) {
      return scene.camera(x, scene.landmarks[i]);
    });
    CHECK(result.status == UpdateStatus::kConverged);
    CHECK(result.residual <= 0.01);
    CHECK(result.steps <= 8);
    const auto whitened = detail::solve_lower<double, 6, 1>(
        detail::cholesky_factor<double, 6>(expected.posterior.covariance).value(),
        result.posterior.pose.boxminus(expected.posterior.pose));
    CHECK(whitened.norm() <= 0.05);
    CHECK(result.posterior.covariance.isApprox(expected.posterior.covariance, 0.01));
    CHECK(result.log_evidence == Approx(expected.log_evidence).margin(0.05));
  }
}

TEST_CASE("The covariance of Gauss-Newton matches its error", "[gauss-newton]") {
  constexpr int kTrials = 100;
  double sum = 0.0;
  for (unsigned seed = 0; seed < kTrials; ++seed) {
    Rng rng(seed);
    const PoseGaussian<double> prior{random_pose<double>(rng), pose_covariance<double>(0.14, 1.0)};
    const auto truth = draw(rng, prior);
    const auto scene = StereoScene<double>::random(rng, truth, 30);
    GaussNewtonPoseFilter<double> filter(prior);
    const auto result = filter.update(
        GaussianMeasurements(measurements_of(scene), StereoWithJacobian{scene.camera, scene.landmarks}));
    CHECK(result.status == UpdateStatus::kConverged);
    sum += nees(filter.belief(), truth);
  }
  CHECK(std::abs(sum / kTrials - 6.0) <= 3.0 * std::sqrt(12.0 / kTrials));
}

TEST_CASE("Gauss-Newton reports what it cannot do", "[gauss-newton][error]") {
  Rng rng(1);
  const PoseGaussian<double> prior{random_pose<double>(rng), pose_covariance<double>(0.02, 0.2)};
  const auto scene = StereoScene<double>::random(rng, prior.pose, 10);
  const StereoWithJacobian h{scene.camera, scene.landmarks};
  const auto measurements = measurements_of(scene);
  CHECK(gauss_newton_update(prior, Measurements{}, h).status == UpdateStatus::kConverged);
  CHECK(gauss_newton_update(prior, measurements, h, {.max_iterations = 1}).status == UpdateStatus::kDiverged);
  CHECK(gauss_newton_update(prior, measurements, h, {.min_log_likelihood = 1.0}).status ==
        UpdateStatus::kDiverged);
  auto broken = measurements;
  broken[2].z[0] = std::nan("");
  CHECK(gauss_newton_update(prior, broken, h).status == UpdateStatus::kNotFinite);
  broken = measurements;
  broken[2].R(1, 1) = -1.0;
  CHECK(gauss_newton_update(prior, broken, h).status == UpdateStatus::kNotFinite);
  const auto nothing = [](const Pose&, std::size_t, Matrix<double, 3, 6>&) -> std::optional<Point> {
    return std::nullopt;
  };
  CHECK(gauss_newton_update(prior, measurements, nothing).status == UpdateStatus::kNoSupport);
  CHECK(
      contains(error_message([&] { (void)gauss_newton_update(prior, measurements, h, {.tolerance = -1.0}); }),
               "tolerance is not positive: -1"));
  auto certain = prior;
  certain.covariance.row(2).setZero();
  certain.covariance.col(2).setZero();
  const auto stays = gauss_newton_update(certain, measurements, h);
  CHECK(stays.status == UpdateStatus::kConverged);
  CHECK(std::abs(stays.posterior.covariance(2, 2)) <= 1e-12);
}

TEST_CASE("A posterior whose points are too far away for numbers is not called converged",
          "[gauss-newton][linearized][error]") {
  PoseGaussian<double> prior{Pose::identity(), Matrix6<double>::Identity()};
  prior.covariance(0, 0) = 5e307;  // found by tests/fuzz
  const std::vector<NoisyMeasurement<double, 1>> measurements{
      {Vector<double, 1>(0.1), Vector<double, 1>(1.0)}};
  const auto height = [](const Pose& x, std::size_t, Matrix<double, 1, 6>& J) {
    J << 0, 0, 0, 0, 0, 1;
    return Vector<double, 1>(x.translation()[2]);
  };
  CHECK(gauss_newton_update(prior, measurements, height).status != UpdateStatus::kConverged);
  const auto value = [](const Pose& x, std::size_t) { return Vector<double, 1>(x.translation()[2]); };
  CHECK(linearized_update(prior, measurements, value).status == UpdateStatus::kNotFinite);
}

TEST_CASE("A range that bends the posterior is not called converged", "[gauss-newton]") {
  const SplitPoseGaussian<double> prior{Pose::identity(), pose_covariance<double>(0.17, 2.0)};
  const Point beacon(30, 10, 5);
  const std::vector<NoisyMeasurement<double, 1>> measurements{
      {Vector<double, 1>(32.0), Vector<double, 1>(0.05 * 0.05)}};
  const auto range = [&](const Pose& x, std::size_t, Matrix<double, 1, 6>& J) {
    const Point away = x.translation() - beacon;
    J << 0, 0, 0, away.transpose() / away.norm();
    return Vector<double, 1>(away.norm());
  };
  const auto result = gauss_newton_update(prior, measurements, range);
  CHECK(result.status == UpdateStatus::kNotGaussian);
  CHECK(result.residual > 0.5);
}
