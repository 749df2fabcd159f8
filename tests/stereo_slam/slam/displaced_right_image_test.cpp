// SPDX-License-Identifier: MIT
#include <cmath>
#include <cstddef>
#include <random>
#include <utility>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "stereo_slam/dataset/sequence.hpp"
#include "stereo_slam/settings/presets.hpp"
#include "stereo_slam/slam/slam.hpp"
#include "stereo_slam/support/rendered_drive.hpp"
#include "support/catch.hpp"

// Right images that are displaced along the rows, which shows in no single pair, and across them.

namespace stereo_slam {
namespace {

[[nodiscard]] const test::RenderedDrive& long_street() {
  static const test::RenderedDrive drive = [] {
    simulator::SimulationSettings settings;
    settings.frames = 72;
    settings.camera = scaled(settings.camera, 0.5);
    return test::RenderedDrive(settings);
  }();
  return drive;
}

/// The image moved to the right and down; its border is repeated.
[[nodiscard]] cv::Mat moved(const cv::Mat& image, double columns, double rows) {
  const cv::Matx23d shift(1.0, 0.0, columns, 0.0, 1.0, rows);
  cv::Mat result;
  cv::warpAffine(image, result, shift, image.size(), cv::INTER_CUBIC, cv::BORDER_REPLICATE);
  return result;
}

/// Tracks frame i of the street with the right image moved to the right and down.
FrameResult process(Slam& slam, std::size_t i, double columns, double rows) {
  StereoFrame frame = load_frame(long_street().sequence, i);
  frame.right = moved(frame.right, columns, rows);
  return slam.process(frame);
}

[[nodiscard]] double relative_step_error(const Pose& step, const Eigen::Isometry3d& truth) {
  return (step.translation() - truth.translation()).norm() / truth.translation().norm();
}

TEST_CASE("Lengths are right although the right image was cut in the wrong column",
          "[stereo_slam][slam][rectification]") {
  const test::RenderedDrive& drive = long_street();
  const int columns = GENERATE(-3, 2);
  CAPTURE(columns);
  Slam slam(drive.sequence.camera, Settings{});
  for (std::size_t i = 0; i < drive.sequence.frames.size(); ++i) {
    CHECK_FALSE(process(slam, i, columns, 0).weak.right_camera_turned);
  }
  slam.finish();
  CHECK(std::abs(slam.rig().right_image_displacement_px - columns) < 0.2);
  const auto path = slam.trajectory();
  for (std::size_t i = 20; i < path.size(); ++i) {
    CAPTURE(i);
    const Pose step = path[i - 1].pose.inverse() * path[i].pose;
    CHECK(relative_step_error(step, drive.truth[i - 1].inverse() * drive.truth[i]) < 0.01);
  }
}

TEST_CASE("A right camera that turns in mid-drive is measured at once, and the turn is told",
          "[stereo_slam][slam][rectification]") {
  const test::RenderedDrive& drive = long_street();
  constexpr std::size_t kTurn = 4;
  const auto [columns, rows] =
      GENERATE(std::pair{2.0, 0.0}, std::pair{0.0, 2.0}, std::pair{-1.0, 4.0}, std::pair{0.5, 0.0});
  CAPTURE(columns, rows);
  Slam slam(drive.sequence.camera, Settings{});
  int noticed = 0;
  for (std::size_t i = 0; i < drive.sequence.frames.size(); ++i) {
    const bool turned = i >= kTurn;
    const auto result = process(slam, i, turned ? columns : 0.0, turned ? rows : 0.0);
    CAPTURE(i);
    if (result.weak.right_camera_turned) {
      ++noticed;
    } else if (i > 0) {
      CHECK(result.status == TrackingStatus::kOk);
    }
  }
  CHECK(noticed == 1);
  slam.finish();
  const auto path = slam.trajectory();
  for (std::size_t i = 1; i < path.size(); ++i) {
    CAPTURE(i);
    const Pose step = path[i - 1].pose.inverse() * path[i].pose;
    CHECK(relative_step_error(step, drive.truth[i - 1].inverse() * drive.truth[i]) < 0.02);
  }
}

TEST_CASE("A right camera that vibrates is measured in every frame", "[stereo_slam][slam][rectification]") {
  const test::RenderedDrive& drive = long_street();
  std::mt19937_64 random(2);
  std::uniform_int_distribution<int> columns(-3, 3), rows(-1, 1);
  Slam slam(drive.sequence.camera, Settings{});
  for (std::size_t i = 0; i < drive.sequence.frames.size(); ++i) {
    const int right = columns(random), down = rows(random);
    const auto result = process(slam, i, i > 0 ? right : 0, i > 0 ? down : 0);
    CAPTURE(i);
    if (i > 0) CHECK(result.status == TrackingStatus::kOk);
  }
  slam.finish();
  const auto path = slam.trajectory();
  const Pose way = path.front().pose.inverse() * path.back().pose;
  CHECK(relative_step_error(way, drive.truth.front().inverse() * drive.truth.back()) < 0.02);
}

TEST_CASE("Frames without a right image do not end the tracking of a rig that vibrates",
          "[stereo_slam][slam][rectification]") {
  const test::RenderedDrive& drive = long_street();
  constexpr std::size_t kMissing = 20, kBack = 22;
  std::mt19937_64 random(4);
  std::uniform_int_distribution<int> columns(-3, 3);
  Slam slam(drive.sequence.camera, Settings{});
  for (std::size_t i = 0; i < kBack + 20; ++i) {
    StereoFrame frame = load_frame(drive.sequence, i);
    frame.right = moved(frame.right, i > 0 ? columns(random) : 0, 0);
    const bool missing = i >= kMissing && i < kBack;
    if (missing) {
      frame.right.setTo(0);
      frame.right_fault = "missing";
    }
    const auto result = slam.process(frame);
    CAPTURE(i);
    if (i > 0) CHECK(result.status == (missing ? TrackingStatus::kWeak : TrackingStatus::kOk));
  }
}

TEST_CASE("Rows that are displaced from the start on are learned in the first frame",
          "[stereo_slam][slam][rectification]") {
  const test::RenderedDrive& drive = long_street();
  const int rows = GENERATE(2, -12);
  CAPTURE(rows);
  Slam slam(drive.sequence.camera, Settings{});
  for (std::size_t i = 0; i < drive.sequence.frames.size(); ++i) {
    const auto result = process(slam, i, 0, rows);
    if (i == 0) continue;
    CAPTURE(i);
    CHECK(result.status == TrackingStatus::kOk);
    CHECK(relative_step_error(result.odometry.pose, drive.truth[i - 1].inverse() * drive.truth[i]) < 0.02);
  }
}

TEST_CASE("Displaced rows are learned after a dark start", "[stereo_slam][slam][rectification]") {
  Slam slam(long_street().sequence.camera, Settings{});
  for (std::size_t i = 0; i < 6; ++i) {
    StereoFrame frame = load_frame(long_street().sequence, i);
    frame.right = moved(frame.right, 0, 4);
    if (i < 3) frame.left = frame.right = cv::Mat::zeros(frame.left.size(), CV_8UC1);
    const auto result = slam.process(frame);
    CAPTURE(i);
    if (i < 3) CHECK(result.status == TrackingStatus::kLost);
    if (i > 3) CHECK(result.status == TrackingStatus::kOk);
  }
}

TEST_CASE("Nothing is noticed where the right image is in its place", "[stereo_slam][slam][rectification]") {
  const test::RenderedDrive& drive = long_street();
  Slam slam(drive.sequence.camera, Settings{});
  for (std::size_t i = 0; i < drive.sequence.frames.size(); ++i) {
    CHECK_FALSE(process(slam, i, 0, 0).weak.right_camera_turned);
  }
  CHECK(slam.rig().right_image_displacement_px == 0.0);
}

}  // namespace
}  // namespace stereo_slam
