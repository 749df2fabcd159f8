// SPDX-License-Identifier: MIT
#include <cstdint>
#include <string>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "stereo_slam/dataset/sequence.hpp"
#include "stereo_slam/settings/presets.hpp"
#include "stereo_slam/slam/slam.hpp"
#include "stereo_slam/support/rendered_drive.hpp"
#include "support/catch.hpp"

// Points that rest in the image although the camera moves, and points that move although it rests.

namespace stereo_slam {
namespace {

constexpr int kDisparity_px = 10;

/// A rough surface, wider than an image of the given size.
[[nodiscard]] cv::Mat1b surface(cv::Size image) {
  cv::RNG random(1);
  cv::Mat1b coarse(image.height / 4 + 1, image.width / 2 + 1);
  random.fill(coarse, cv::RNG::UNIFORM, 28, 228);
  cv::Mat1b fine;
  cv::resize(coarse, fine, {2 * image.width, image.height}, 0.0, 0.0, cv::INTER_CUBIC);
  return fine;
}

/// The surface in `region` of both images, moved to the left by `shift_px`, with a constant disparity.
void cover(StereoFrame& frame, const cv::Mat1b& texture, const cv::Rect& region, int shift_px) {
  frame.left = frame.left.clone();
  frame.right = frame.right.clone();
  const cv::Rect seen_left = region + cv::Point(shift_px, 0);
  texture(seen_left).copyTo(frame.left(region));
  texture(seen_left + cv::Point(kDisparity_px, 0)).copyTo(frame.right(region));
}

[[nodiscard]] simulator::SimulationSettings street(int frames) {
  simulator::SimulationSettings settings;
  settings.frames = frames;
  settings.camera = scaled(settings.camera, 0.5);
  return settings;
}

TEST_CASE("A part of the vehicle in view does not stop the camera", "[stereo_slam][slam][dynamic]") {
  const test::RenderedDrive drive(street(12));
  const std::string preset = GENERATE("default", "fast", "paper");
  CAPTURE(preset);
  const auto slam = make_slam_system(drive.sequence.camera, preset_settings(preset));
  for (std::size_t i = 0; i < drive.sequence.frames.size(); ++i) {
    StereoFrame frame = load_frame(drive.sequence, i);
    const cv::Size image = frame.left.size();
    const int top = image.height * 85 / 100;
    cover(frame, surface(image), {0, top, image.width, image.height - top}, 0);
    const auto result = slam->process(frame);
    if (i == 0) continue;
    CAPTURE(i);
    CHECK(result.status == TrackingStatus::kOk);
    const Eigen::Isometry3d step = drive.truth[i - 1].inverse() * drive.truth[i];
    CHECK((result.odometry.pose.translation() - step.translation()).norm() <
          0.05 * step.translation().norm());
  }
}

TEST_CASE("A vehicle that passes in front of a standing camera does not move it, from the first frame on",
          "[stereo_slam][slam][dynamic]") {
  const test::RenderedDrive drive(street(2));
  Slam slam(drive.sequence.camera, Settings{});
  for (int i = 0; i < 8; ++i) {
    StereoFrame frame = load_frame(drive.sequence, 0);
    frame.index = static_cast<std::size_t>(i);
    frame.stamp_ns += std::int64_t{100'000'000} * i;
    const cv::Size image = frame.left.size();
    cover(frame, surface(image), {image.width / 4, 0, image.width * 2 / 5, image.height}, 6 * i);
    const auto result = slam.process(frame);
    if (i == 0) continue;
    CAPTURE(i);
    CHECK(result.status == TrackingStatus::kOk);
    CHECK(result.odometry.pose.translation().norm() < 0.02);
  }
}

}  // namespace
}  // namespace stereo_slam
