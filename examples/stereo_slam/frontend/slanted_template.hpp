// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>

#include <Eigen/Core>
#include <opencv2/core.hpp>

namespace stereo_slam {

/// A window of 9 x 9 pixels of the left image, to be found in the right image where the disparity is linear
/// in the pixel.
///
/// The four parameters of the search are the position in the right image (u and v, px) and the slope of the
/// disparity (d disparity / d u and d disparity / d v). The method is inverse compositional: the gradients
/// with respect to the parameters are those of the left window. A gain and an offset of the grey values have
/// no effect: values and gradients have zero mean, and the gradients are orthogonal to the values.
///
/// On x86 processors with AVX2 registers of eight numbers are used. The order of the sums is the same
/// without.
class SlantedTemplate {
 public:
  /// The smallest window that shows slopes well. Larger ones contain other surfaces: with 11 x 11 pixels the
  /// estimated path is too long.
  static constexpr int kRadius_px = 4;
  static constexpr int kSide_px = 2 * kRadius_px + 1;

  /// The window around `centre`, which is at least kRadius_px + 1 inside the 8-bit image.
  SlantedTemplate(const cv::Mat& left, const Eigen::Vector2f& centre);

  [[nodiscard]] const Eigen::Matrix4f& information() const noexcept { return content_.information; }

  /// How a window of the right image compares with this one.
  struct Comparison {
    /// Gradient, with respect to the parameters, of half the squared error of the grey values, times the
    /// gain.
    Eigen::Vector4f gradient;
    float gain = 0.0F;  ///< of the right window's contrast relative to this one's; 0 if this is uniform
    float correlation = 0.0F;  ///< zero-mean and normalised, -1..1; 0 if one of them is uniform
  };

  /// Compares the window of the right image that has this centre and slope of the disparity; all of its
  /// pixels are inside the 8-bit image.
  [[nodiscard]] Comparison compare(const cv::Mat& right, const Eigen::Vector2f& centre,
                                   const Eigen::Vector2f& slope) const;

  /// Eight numbers: one register with AVX2, two without.
  using Eight [[gnu::vector_size(8 * sizeof(float))]] = float;

  /// One number for each pixel: the first eight of each row, then the last ones of the rows. Numbers that
  /// are left over are zero.
  using Pixels = std::array<Eight, kSide_px + 2>;

  /// What is known of the window.
  struct Content {
    Pixels value;
    std::array<Pixels, 4> gradient;  ///< of the values with respect to the parameters
    float mean = 0.0F;               ///< of the grey values
    float energy = 0.0F;             ///< sum of the squared values
    Eigen::Matrix4f information;     ///< J^T J of the grey values with respect to the parameters
  };

 private:
  Content content_;
};

}  // namespace stereo_slam
