// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/settings/settings.hpp"

/// What is done to images between camera and SLAM, besides rectification.
namespace stereo_slam {

/// A copy of the image as CV_8UC1. Colour (BGR, BGRA) is converted to grey; of 16 bits the upper eight are
/// used. Throws std::invalid_argument for another type.
[[nodiscard]] cv::Mat to_grey(const cv::Mat& image);

/// Which of the values of 16 bits a pixel become which grey levels: (value - black) / step.
struct GreyScale {
  double black = 0.0;      ///< the value of grey level 0
  double step = 256.0;     ///< from one grey level to the next; at least 1
  bool by_median = false;  ///< the median of each image becomes medium grey, and `black` has no meaning

  /// The scale of a camera with so many bits, of which the upper eight are used.
  [[nodiscard]] static GreyScale of_bits(int bits);

  [[nodiscard]] bool operator==(const GreyScale&) const = default;
};

/// A CV_16UC1 image as CV_8UC1. Values beyond the scale become black and white.
[[nodiscard]] cv::Mat to_grey(const cv::Mat& image, const GreyScale& scale);

/// The values in images of 16 bits a pixel.
class ValueCounts {
 public:
  /// Adds a CV_16UC1 image.
  void add(const cv::Mat& image);

  /// How many bits the largest value needs, rounded up to an even number, at least eight: 12 if none is above
  /// 4095.
  [[nodiscard]] int bits() const;

  /// The smallest value that at least a share of all values do not exceed.
  [[nodiscard]] double quantile(double share) const;

  /// The middle one of the ranges of the values in single images, without a share of kTail at each end.
  [[nodiscard]] double range_of_one() const;

  /// Whether the two bytes of the values look exchanged: the other way round neighbours differ less than half
  /// as much, in units of the contrast of their image. Exchanged bytes make noise of any image that uses both
  /// of them, so images that are right never become smoother.
  [[nodiscard]] bool have_exchanged_bytes() const;

  /// The scale of bits(), if it gives single images enough contrast. Otherwise, as of a thermal camera, the
  /// one that gives the values between quantile(kTail) and quantile(1 - kTail) the middle half of all grey
  /// levels. If these are much more than the values in single images, because the values drift or those of
  /// the two cameras differ, the one that gives half of all grey levels to each image, by its median.
  [[nodiscard]] GreyScale scale() const;

  static constexpr double kTail = 0.01;  ///< more than the hot pixels and the rows of metadata of a camera

 private:
  /// The values of a single image.
  void count(const cv::Mat& image);

  std::vector<std::uint64_t> counts_ = std::vector<std::uint64_t>(65536);  // of 500 rows or more
  double largest_ = 0.0;                                                   // of all rows
  std::vector<double> ranges_;                                             // of the images
  double roughness_ = 0.0;            // sum over the images of the differences of neighbours per contrast
  double exchanged_roughness_ = 0.0;  // the same with exchanged bytes
};

/// How much neighbouring rows and columns differ, in units of those two apart (means of absolute values): 0.5
/// to 0.8 in images of one moment, and 1 if they are independent, as of noise alone. Zero without any
/// difference.
struct Alternation {
  double rows = 0.0;
  double columns = 0.0;

  static constexpr double kMost = 1.2;  ///< what lies above it alternates between two pictures

  /// As interlaced video, whose even and odd rows are of two moments.
  [[nodiscard]] bool is_interlaced() const { return rows > kMost && columns <= kMost; }
  /// As the raw image of a colour camera, whose pixels have filters of several colours.
  [[nodiscard]] bool is_mosaic() const { return rows > kMost && columns > kMost; }
};

/// Of a CV_8UC1 image as it was recorded.
[[nodiscard]] Alternation alternation_of(const cv::Mat& image);

/// Equalises the contrast of both images locally (CLAHE), if the settings want it.
void equalise_contrast(StereoFrame& frame, const ImageSettings& settings);

}  // namespace stereo_slam
