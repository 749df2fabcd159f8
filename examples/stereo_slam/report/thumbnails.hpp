// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "stereo_slam/core/types.hpp"

namespace stereo_slam::report {

/// A small image of a frame.
struct Thumbnail {
  std::size_t frame = 0;
  std::vector<std::uint8_t> jpeg;
};

/// Small left images of a run, at equal distances in time: at most kMost, however long it is. Frames are
/// offered as they are processed. When there are too many images every second one goes, and from then on half
/// as many frames are kept; so a run of n frames encodes about 30 log2(n) of them.
class Thumbnails {
 public:
  static constexpr std::size_t kMost = 60;
  static constexpr int kWidth_px = 200;

  /// Keeps an image of the frame if it is its turn.
  void offer(const StereoFrame& frame);

  [[nodiscard]] const std::vector<Thumbnail>& images() const { return images_; }

 private:
  std::vector<Thumbnail> images_;
  std::size_t offered_ = 0;
  std::size_t spacing_ = 4;  // of frames
};

/// `image` (CV_8UC1) as a JPEG, at most kWidth_px wide.
[[nodiscard]] std::vector<std::uint8_t> small_jpeg(const cv::Mat& image);

[[nodiscard]] std::string base64(const std::vector<std::uint8_t>& bytes);

}  // namespace stereo_slam::report
