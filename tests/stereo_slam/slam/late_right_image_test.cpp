// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <optional>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/dataset/sequence.hpp"
#include "stereo_slam/slam/slam.hpp"
#include "stereo_slam/support/rendered_drive.hpp"
#include "support/catch.hpp"

// Right images that are exposed later than the left ones.

namespace stereo_slam {
namespace {

/// A drive whose right images are a fifth, or half of the time between two frames late.
[[nodiscard]] const test::RenderedDrive& late_drive(double late_s, std::size_t frames) {
  static std::map<double, test::RenderedDrive> drives;
  const auto known = drives.find(late_s);
  if (known != drives.end()) return known->second;
  simulator::SimulationSettings settings;
  settings.frames = frames;
  settings.camera = scaled(settings.camera, 0.5);
  settings.disturbance.sync_error_s = late_s;
  return drives.emplace(late_s, settings).first->second;
}

/// Largest error of the position relative to the first frame, over the length of the path there.
[[nodiscard]] double largest_error(Slam& slam, const test::RenderedDrive& drive) {
  double largest = 0.0, path_m = 0.0;
  for (std::size_t i = 0; i < drive.sequence.frames.size(); ++i)
    (void)slam.process(load_frame(drive.sequence, i));
  slam.finish();
  const auto poses = slam.trajectory();
  const auto& truth = drive.truth;
  for (std::size_t i = 1; i < poses.size(); ++i) {
    const Eigen::Isometry3d step = truth[i - 1].inverse() * truth[i];
    const Eigen::Isometry3d from_first = truth.front().inverse() * truth[i];
    path_m += step.translation().norm();
    const Vector3<double> moved = (poses.front().pose.inverse() * poses[i].pose).translation();
    constexpr double kEnough_m = 10.0;
    if (path_m > kEnough_m) largest = std::max(largest, (moved - from_first.translation()).norm() / path_m);
  }
  return largest;
}

TEST_CASE(
    "A delay of the right images that is known roughly is measured to a millisecond, and lengths are right",
    "[stereo_slam][slam][rectification]") {
  constexpr double kLate_s = 0.02;
  const test::RenderedDrive& drive = late_drive(kLate_s, 45);  // into the first bend
  Slam unaware(drive.sequence.camera, Settings{});
  const double error_unaware = largest_error(unaware, drive);
  CHECK_FALSE(unaware.rig().right_delay);
  Slam slam(drive.sequence.camera, Settings{});
  slam.begin_with_delay({.seconds = 0.018, .sigma_s = 0.002});
  const double error = largest_error(slam, drive);
  REQUIRE(slam.rig().right_delay);
  CAPTURE(slam.rig().right_delay->seconds, slam.rig().right_delay->sigma_s, error, error_unaware);
  CHECK(std::abs(slam.rig().right_delay->seconds - kLate_s) < 0.001);
  CHECK(error < 0.005);  // as a disparity that is wrong by a twentieth of a pixel at ten pixels
  CHECK(5.0 * error < error_unaware);
}

TEST_CASE("A map begins with late right images, however the rig pitches until their exposure",
          "[stereo_slam][slam][rectification]") {
  simulator::SimulationSettings settings;
  settings.frames = 12;
  settings.seed = 13;
  settings.camera = scaled(settings.camera, 0.5);
  settings.disturbance.sync_error_s = 0.05;
  settings.ride.bounce_m = 0.008;
  const test::RenderedDrive drive(settings);
  Slam slam(drive.sequence.camera, Settings{});
  slam.begin_with_delay({.seconds = 0.05, .sigma_s = 0.005});
  for (std::size_t i = 0; i < drive.sequence.frames.size(); ++i) {
    const FrameResult result = slam.process(load_frame(drive.sequence, i));
    CAPTURE(i, to_string(result.status));
    CHECK(result.status != TrackingStatus::kLost);
    CHECK((i == 0 || i > 5 || result.status == TrackingStatus::kOk));  // the map begins with enough points
  }
}

TEST_CASE("A late frame without a right image, or with one that shows nothing, ends nothing",
          "[stereo_slam][slam][rectification]") {
  const test::RenderedDrive& drive = late_drive(0.05, 75);
  for (const bool black : {false, true}) {
    Slam slam(drive.sequence.camera, Settings{});
    slam.begin_with_delay({.seconds = 0.05, .sigma_s = 0.005});
    for (std::size_t i = 0; i < 10; ++i) {
      StereoFrame frame = load_frame(drive.sequence, i);
      if (i == 0 || i == 5) {
        frame.right = black ? cv::Mat(cv::Mat::zeros(frame.left.size(), CV_8UC1)) : cv::Mat();
        if (!black) frame.right_fault = "missing";
      }
      if (i == 6) frame.left = cv::Mat::zeros(frame.left.size(), CV_8UC1);
      const FrameResult result = slam.process(frame);
      CHECK(result.T_world_camera.pose.translation().allFinite());
    }
    CHECK(slam.trajectory().size() == 10);
  }
}

TEST_CASE("A delay that begins a tenth wrong converges, also where the yaw rate jumps",
          "[stereo_slam][slam][rectification]") {
  constexpr double kLate_s = 0.05;
  const test::RenderedDrive& drive = late_drive(kLate_s, 75);  // through the first bend
  for (const double wrong_s : {-0.005, 0.005}) {
    Slam slam(drive.sequence.camera, Settings{});
    slam.begin_with_delay({.seconds = kLate_s + wrong_s, .sigma_s = 0.005});
    const double error = largest_error(slam, drive);
    REQUIRE(slam.rig().right_delay);
    CAPTURE(wrong_s, slam.rig().right_delay->seconds, slam.rig().right_delay->sigma_s, error);
    CHECK(std::abs(slam.rig().right_delay->seconds - kLate_s) < 4.0 * slam.rig().right_delay->sigma_s);
    CHECK(slam.rig().right_delay->sigma_s < 0.0005);
    CHECK(error < 0.017);  // 9 mm of the baseline of 54 cm: what a millisecond costs
  }
}

}  // namespace
}  // namespace stereo_slam
