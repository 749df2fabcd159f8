// SPDX-License-Identifier: MIT
#pragma once

#include <span>

#include <Eigen/Core>
#include <opencv2/core.hpp>

namespace stereo_slam {

/// Stereo match of a patch on a slanted surface: its disparity is linear in the pixel.
struct SlantedMatch {
  Eigen::Vector2d right_px;                                   ///< of the patch's centre, in the right image
  Eigen::Vector2d disparity_slope = Eigen::Vector2d::Zero();  ///< d disparity / d (u, v)
  double correlation = 0.0;                                   ///< of the two patches; 0 if not refined
};

/// Refines a stereo match that was aligned as if the disparity of the patch were constant, in 8-bit images.
///
/// Position, slope, gain and offset are estimated together, on 9 x 9 pixels. The prior of the slope is a
/// mixture: a wide Gaussian around zero, and a narrow one around each of `likely_slopes`, the slopes of
/// common surfaces. The component that fits the texture best is used. The prior matters where the texture
/// does not determine the slope. Returns the given match with the slope zero if the patch leaves an image,
/// does not correlate, or moves away from the match.
[[nodiscard]] SlantedMatch refine_slanted(const cv::Mat& left, const Eigen::Vector2d& left_px,
                                          const cv::Mat& right, const Eigen::Vector2d& right_px,
                                          std::span<const Eigen::Vector2d> likely_slopes = {});

}  // namespace stereo_slam
