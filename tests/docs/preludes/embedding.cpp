// SPDX-License-Identifier: MIT
// The blocks of docs/embedding.md with a camera that passes a textured wall sideways, and a check of where
// they say it is.
#include <cstdint>
#include <filesystem>
#include <iostream>

#include "embedding.includes.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

namespace {

using stereo_slam::test::TinySequence;

constexpr int kFrames = 8;

/// 0.16 m to the right with every frame.
class Camera {
 public:
  bool read(cv::Mat& left, cv::Mat& right) {
    if (++frame_ == kFrames) return false;
    const cv::Rect view(TinySequence::kShift_px * frame_, 0, TinySequence::kWidth, TinySequence::kHeight);
    left = texture_(view);
    right = texture_(view + cv::Point(TinySequence::kDisparity_px, 0));
    return true;
  }
  [[nodiscard]] std::int64_t stamp_ns() const { return 100'000'000LL * frame_; }

 private:
  cv::Mat texture_ = stereo_slam::test::tiny_texture(TinySequence::kWidth + TinySequence::kDisparity_px +
                                                     TinySequence::kShift_px * kFrames);
  int frame_ = -1;
};

}  // namespace

TEST_CASE("The SLAM in a program follows its camera, and its map is there the next day", "[docs]") {
  const antipode::test::TemporaryFolder folder;
  std::filesystem::current_path(folder.path());
  antipode::test::write_text("calibration.yaml", stereo_slam::test::tiny_calibration());
  Camera camera;
  cv::Mat left;
  cv::Mat right;
#include "embedding.inc"
  const auto last = slam.trajectory().back().T_world_camera.pose.translation();
  CHECK(last.x() == Approx(0.16 * (kFrames - 1)).margin(0.05));
  CHECK(std::filesystem::file_size("hall.map") > 1000);
  CHECK(next_day.camera().baseline_m == 0.4);
  std::filesystem::current_path("/");
}
