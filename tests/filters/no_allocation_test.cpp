// SPDX-License-Identifier: MIT
#include "support/no_allocation.hpp"

#include <functional>
#include <vector>

#include <antipode/filters/gaussian_measurements.hpp>
#include <antipode/filters/pose_filter.hpp>
#include <antipode/filters/predict.hpp>
#include <antipode/filters/progressive_update.hpp>
#include <antipode/filters/quadratic_update.hpp>
#include <antipode/filters/unscented_update.hpp>
#include <antipode/filters/update_status.hpp>

#include "filters/models.hpp"
#include "support/catch.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

struct Measured {
  PoseGaussian<double> state;
  BinghamGaussian<double> density;
  StereoScene<double> scene;
  AnyLogLikelihood<double> log_likelihood = std::cref(scene);

  explicit Measured(unsigned seed)
      : state{DualQuaternion<double>::identity(), pose_covariance<double>(0.02, 0.2)},
        density(to_bingham_gaussian(state)) {
    Rng rng(seed);
    scene = StereoScene<double>::random(rng, draw(rng, state), 40);
  }
};

}  // namespace

TEST_CASE("Prediction does not allocate", "[allocation]") {
  const Measured s(1);
  const auto predicted =
      without_allocation([&] { return predict(s.density, s.state.pose, s.density, JointPoseRule{}); });
  CHECK(predicted.covariance().allFinite());
  const auto closed = without_allocation([&] { return predict_closed_form(s.state, s.state.pose, s.state); });
  CHECK(closed.covariance.allFinite());
}

TEST_CASE("The progressive update does not allocate", "[allocation]") {
  const Measured s(2);
  const auto result =
      without_allocation([&] { return progressive_update(s.density, s.log_likelihood, JointPoseRule{}); });
  CHECK(result.status == UpdateStatus::kConverged);
  const std::function<AnyLogLikelihood<double>(int, int)> likelihood_of = [&](int begin, int end) {
    return [&, begin, end](const DualQuaternion<double>& x) { return s.scene(x) * (end - begin) / 40; };
  };
  const auto in_subsets = without_allocation(
      [&] { return progressive_update_subsets(s.density, 40, likelihood_of, JointPoseRule{}); });
  CHECK(in_subsets.status == UpdateStatus::kConverged);
}

TEST_CASE("The quadratic update does not allocate", "[allocation]") {
  const Measured s(3);
  const auto result = without_allocation([&] { return quadratic_update(s.state, s.log_likelihood); });
  CHECK(result.status == UpdateStatus::kConverged);
}

TEST_CASE("The linearised update does not allocate", "[allocation]") {
  const Measured s(5);
  std::vector<NoisyMeasurement<double, 3>> noisy;
  for (const auto& z : s.scene.measurements) noisy.push_back({z, Matrix3<double>::Identity()});
  const GaussianMeasurements measurements(noisy, [&](const DualQuaternion<double>& x, std::size_t i) {
    return s.scene.camera(x, s.scene.landmarks[i]);
  });
  LinearizedPoseFilter<double> filter(s.state);
  const auto result = without_allocation([&] { return filter.update(measurements); });
  CHECK(result.status == UpdateStatus::kConverged);
  CHECK(without_allocation([&] { return measurements(s.state.pose); }) < 0.0);
}

TEST_CASE("Composition of uncertain poses does not allocate", "[allocation]") {
  const Measured s(6);
  const auto product = [](const DualQuaternion<double>& a, const DualQuaternion<double>& b) { return a * b; };
  const Matrix6<double> none = Matrix6<double>::Zero();
  const auto composed =
      without_allocation([&] { return propagate(CubatureRule<12>{}, s.state, s.state, none, product); });
  CHECK(composed.covariance.allFinite());
}

TEST_CASE("The unscented update does not allocate", "[allocation]") {
  const Measured s(4);
  const auto poses = sample(PaperPoseRule{}, s.density);
  const AnyPairModel<double> camera = std::cref(s.scene.camera);
  const Vector3<double> z = s.scene.measurements[0];
  const Matrix3<double> R = Matrix3<double>::Identity();
  const Gaussian<double, 3> landmark(s.scene.landmarks[0], 0.1 * R);
  const auto projected = without_allocation([&] { return project_gaussian(landmark, poses, camera); });
  CHECK(projected.has_value());
  const auto result = without_allocation([&] { return unscented_update(landmark, poses, camera, {z, R}); });
  CHECK(result.status == UnscentedUpdateStatus::kUpdated);
}
