// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// Image pyramid with borders, ready for Lucas-Kanade; built once per image.
class FlowPyramid {
 public:
  static constexpr int kMaxLevel = 3;
  static constexpr int kMaxWindow_px = 21;

  FlowPyramid() = default;

  /// Flow from this image is faster with derivatives; flow to this image does not use them. The pyramid
  /// reuses the memory of `unused` if it fits: allocation takes as long as building the pyramid.
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

/// `pyramids`, which are those of `frame`, or new ones of the frame with its grey values scaled to the mean
/// of the reference if the means differ by more than a tenth. Flow compares grey values, and the exposure may
/// jump. Dark images are left as they are.
[[nodiscard]] StereoPyramid as_bright_as(const StereoPyramid& reference, const StereoPyramid& pyramids,
                                         const StereoFrame& frame);

struct FlowOptions {
  int window_px = 15;  ///< side of the window, at most FlowPyramid::kMaxWindow_px
  int max_level = 2;   ///< coarsest level used
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
