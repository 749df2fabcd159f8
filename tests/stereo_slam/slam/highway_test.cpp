// SPDX-License-Identifier: MIT
#include "stereo_slam/core/chi_square.hpp"
#include "stereo_slam/core/symmetric_solve.hpp"
#include "stereo_slam/frontend/features.hpp"
#include "stereo_slam/frontend/stereo_points.hpp"
#include "stereo_slam/slam/slam.hpp"
#include "stereo_slam/support/rendered_drive.hpp"

namespace stereo_slam {
namespace {

/// A drive of 110 m along a rendered highway, at 0.6 of KITTI's size. Rendered once.
const test::RenderedDrive& drive() {
  static const test::RenderedDrive rendered([] {
    simulator::SimulationSettings settings;
    settings.scenery = simulator::Scenery::kHighway;
    settings.frames = 40;
    settings.camera = {744, 225, 431.3, 431.3, 364.1, 110.9};
    return settings;
  }());
  return rendered;
}

/// Length of a path of which position(i) are the corners.
template <class Position>
double length_m(std::size_t count, Position position) {
  double length = 0.0;
  for (std::size_t i = 1; i < count; ++i) length += (position(i) - position(i - 1)).norm();
  return length;
}

TEST_CASE("Most of what a rendered highway shows is far away", "[stereo_slam][highway]") {
  constexpr double kFar_baselines = 40.0;  // where the errors of X, Y, Z are no longer Gaussian
  const Settings settings;
  const StereoCamera& camera = drive().sequence.camera;
  const double far_px = camera.fx / kFar_baselines;
  std::size_t all = 0;
  std::size_t far = 0;
  for (const std::size_t i : {std::size_t{0}, std::size_t{20}, std::size_t{39}}) {
    const StereoFrame frame = load_frame(drive().sequence, i);
    const auto features = extract_features(frame.left, settings.features);
    const auto points = measure_stereo_points({frame, camera, PairGeometry(camera)}, features, {}, settings);
    for (const auto& point : points.measured) far += point.z.z() < far_px ? 1U : 0U;
    all += points.measured.size();
  }
  CAPTURE(far, all);
  CHECK(all > 300);
  CHECK(2 * far > all);
}

TEST_CASE("Images with less noise than assumed give smaller covariances, and poses that agree",
          "[stereo_slam][slam][highway]") {
  Settings assumed;
  assumed.update.noise_from_residuals = false;
  Slam with_seen_noise(drive().sequence.camera, {});
  Slam with_assumed_noise(drive().sequence.camera, assumed);
  for (std::size_t i = 0; i < 12; ++i) {
    CAPTURE(i);
    const StereoFrame frame = load_frame(drive().sequence, i);
    const FrameResult seen = with_seen_noise.process(frame);
    const FrameResult expected = with_assumed_noise.process(frame);
    // At keyframes the error of the online rectification is added to both.
    if (seen.nis_dof == 0 || seen.is_keyframe || expected.is_keyframe) continue;
    CHECK(seen.relative_covariance.trace() < expected.relative_covariance.trace());
    const Vector6<double> apart = seen.T_odometry_camera.boxminus(expected.T_odometry_camera);
    CHECK(mahalanobis_squared(apart, expected.relative_covariance) < kChi2_6_95);
  }
}

TEST_CASE("The covariance of the odometry alone is as large as its error", "[stereo_slam][slam][highway]") {
  Settings settings;
  settings.system = SystemKind::kOdometry;
  settings.online_rectification.enabled = false;  // the images are rectified exactly
  Slam slam(drive().sequence.camera, settings);
  std::size_t inside = 0, motions = 0;
  double sum = 0.0;
  for (std::size_t i = 0; i < drive().sequence.frames.size(); ++i) {
    const FrameResult result = slam.process(load_frame(drive().sequence, i));
    if (i == 0) continue;
    const Pose truth = to_pose(drive().truth[i - 1].inverse() * drive().truth[i]);
    const double nees = mahalanobis_squared(truth.boxminus(result.odometry.pose), result.odometry.covariance);
    sum += nees;
    ++motions;
    if (nees < kChi2_6_95) ++inside;
  }
  CAPTURE(inside, motions, sum / static_cast<double>(motions));
  REQUIRE(motions == 39);
  CHECK(inside >= 34);  // of 39: with 95 % each, fewer are as rare as 2 %
  CHECK(sum > 39.0);    // a mean of one sixth of what is expected would be a covariance that is far too large
}

TEST_CASE("Along a rendered highway every frame is tracked and the path has its length",
          "[stereo_slam][slam][highway]") {
  Settings settings;
  // The images are rectified exactly. With disparities of 3 px, what the refinement takes for an offset of
  // the right image changes the length of so short a drive by up to 1.5 %.
  settings.online_rectification.enabled = false;
  Slam slam(drive().sequence.camera, settings);
  for (std::size_t i = 0; i < drive().sequence.frames.size(); ++i) {
    CAPTURE(i);
    const FrameResult result = slam.process(load_frame(drive().sequence, i));
    CHECK(result.status == (i == 0 ? TrackingStatus::kInitializing : TrackingStatus::kOk));
  }
  slam.finish();
  const auto estimate = slam.trajectory();
  const auto& truth = drive().truth;
  REQUIRE(estimate.size() == truth.size());
  const double estimated_m = length_m(
      truth.size(), [&](std::size_t i) -> Eigen::Vector3d { return estimate[i].pose.translation(); });
  const double true_m =
      length_m(truth.size(), [&](std::size_t i) -> Eigen::Vector3d { return truth[i].translation(); });
  CHECK(estimated_m == Approx(true_m).epsilon(0.01));
}

}  // namespace
}  // namespace stereo_slam
