// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// How well image pairs agree with a rectified stereo camera.
struct StereoAgreement {
  std::size_t left_features = 0;  ///< found in all left images
  std::size_t right_features = 0;
  std::size_t matches = 0;
  double unit_px = 1.0;        ///< see ImageCorners
  double row_offset_px = 0.0;  ///< median of |v_left - v_right|: the rectification error plus 0.1 px of noise
  double median_disparity_px = 0.0;  ///< of u_left - u_right
  double near_disparity_px = 0.0;    ///< 90 % of the disparities of matches in one row are below it
  double beyond_share = 0.0;         ///< share of the matches with a disparity beyond +-1 px
  double negative_share =
      0.0;  ///< share of these whose disparity is negative; in a far scene 1 or 0, by the median

  static constexpr std::size_t kEnoughMatches = 50;  ///< with fewer the check is inconclusive

  static constexpr std::size_t kFewFeatures = 4 * kEnoughMatches;  ///< a quarter of them match in most images

  /// The range of disparities, px, that reaches the near points with a reserve.
  [[nodiscard]] int needed_range_px(int width_px) const {
    constexpr double kReserve = 1.5;
    constexpr int kMost_px = 2000;  // of the setting
    return std::min({static_cast<int>(kReserve * near_disparity_px), width_px - 1, kMost_px});
  }

  [[nodiscard]] bool conclusive() const { return matches >= kEnoughMatches; }
};

/// Up to `count` indices spread over a sequence of `frames`; the first one is 0.
[[nodiscard]] std::vector<std::size_t> spread(std::size_t frames, std::size_t count);

/// Matches ORB features between the two images of each frame, to sub-pixel accuracy and without assuming
/// rectification.
[[nodiscard]] StereoAgreement check_stereo_agreement(const std::vector<StereoFrame>& frames);

}  // namespace stereo_slam
