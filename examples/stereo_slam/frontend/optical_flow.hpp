// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// Image pyramid with borders, ready for Lucas-Kanade; built once an image.
class FlowPyramid {
 public:
  static constexpr int kMaxLevel = 3;
  static constexpr int kMaxWindow_px = 21;

  FlowPyramid() = default;

  /// Flow from this image is cheaper with derivatives, flow to it does not use them. The pyramid takes the
  /// memory of one that is no longer used, if it fits: new memory costs as much time as the pyramid.
  explicit FlowPyramid(const cv::Mat& image, bool with_derivatives = true, FlowPyramid unused = {});

  [[nodiscard]] bool empty() const noexcept { return levels_.empty(); }
  [[nodiscard]] const std::vector<cv::Mat>& levels() const noexcept { return levels_; }
  [[nodiscard]] const cv::Mat& image() const noexcept { return levels_.front(); }

 private:
  std::vector<cv::Mat> levels_;
};

/// Left and right pyramid of one frame. The right one is empty where only the left image is used.
struct StereoPyramid {
  FlowPyramid left;
  FlowPyramid right;
};

/// Pyramids of a frame and of the one before it.
struct ConsecutivePyramids {
  const StereoPyramid& previous;
  const StereoPyramid& current;
};

enum class PyramidSides { kLeft, kBoth };

/// Pyramids of a frame, in the memory of `unused`.
[[nodiscard]] StereoPyramid build_pyramids(const StereoFrame& frame, PyramidSides sides = PyramidSides::kBoth,
                                           StereoPyramid unused = {});

/// The pyramids of `frame`, scaled to the mean grey value of the reference if they differ by more than a
/// tenth: flow compares grey values, and the exposure may jump. Dark images are left as they are.
[[nodiscard]] StereoPyramid as_bright_as(const StereoPyramid& reference, const StereoPyramid& pyramids,
                                         const StereoFrame& frame);

struct FlowOptions {
  int window_px = 15;  ///< side of the window, at most FlowPyramid::kMaxWindow_px
  int max_level = 2;   ///< coarsest level used
  int iterations = 20;
  double epsilon_px = 0.01;
};

/// Where the points went, and whether each was found inside the image.
struct FlowResult {
  std::vector<cv::Point2f> points;
  std::vector<std::uint8_t> found;
};

/// Pyramidal Lucas-Kanade flow of `points` (px) from one image to another, starting from `guesses` (as many).
[[nodiscard]] FlowResult track_points(const FlowPyramid& from, const FlowPyramid& to,
                                      const std::vector<cv::Point2f>& points,
                                      const std::vector<cv::Point2f>& guesses, const FlowOptions& options);

}  // namespace stereo_slam
