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

/// Small left images of a run of any length: at most kMost, with equal numbers of frames between them. Frames
/// are offered as they are processed. When there are more than kMost images, every second one is removed, and
/// from then on half as many frames are kept. So only about 30 log2(n) images are scaled in a run of n
/// frames.
class Thumbnails {
 public:
  static constexpr std::size_t kMost = 60;
  static constexpr int kWidth_px = 200;

  /// Keeps an image of every `spacing_`-th frame offered.
  void offer(const StereoFrame& frame);

  /// The images kept so far, as JPEG.
  [[nodiscard]] std::vector<Thumbnail> images() const;

 private:
  struct SmallImage {
    std::size_t frame = 0;
    cv::Mat image;
  };

  std::vector<SmallImage> images_;
  std::size_t offered_ = 0;
  std::size_t spacing_ = 4;  // of frames
};

/// A CV_8UC1 image at most kWidth_px wide: `image` scaled down by a whole number, which takes a tenth of the
/// time of other factors. An image with too few rows for the factor is copied.
[[nodiscard]] cv::Mat small_image(const cv::Mat& image);

/// Empty if the image cannot be encoded.
[[nodiscard]] std::vector<std::uint8_t> to_jpeg(const cv::Mat& image);

[[nodiscard]] std::string base64(const std::vector<std::uint8_t>& bytes);

}  // namespace stereo_slam::report
