// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <vector>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/dataset/sequence.hpp"

namespace stereo_slam {

/// How well pairs of images agree with being the left and right view of a rectified camera.
struct StereoAgreement {
  std::size_t matches = 0;
  double row_offset_px = 0.0;  ///< median of |v_left - v_right|: the rectification error and 0.1 px of noise
  double median_disparity_px = 0.0;  ///< of u_left - u_right
  double beyond_share = 0.0;         ///< of the matches, how many have a disparity beyond +-1 px
  double negative_share = 0.0;       ///< of those, how many are negative

  static constexpr std::size_t kEnoughMatches = 50;  ///< fewer say nothing

  [[nodiscard]] bool conclusive() const { return matches >= kEnoughMatches; }
};

/// Up to `count` indices spread over a sequence, the first one included.
[[nodiscard]] std::vector<std::size_t> spread(std::size_t frames, std::size_t count);

/// Matches ORB features between the two images of each frame, without assuming rectification, to a fraction
/// of a pixel.
[[nodiscard]] StereoAgreement check_stereo_agreement(const std::vector<StereoFrame>& frames);

/// What the agreement says against the recording: swapped cameras (an error); as warnings hardly any matches,
/// the same picture twice, no rectification.
[[nodiscard]] std::vector<Problem> problems_of(const StereoAgreement& agreement,
                                               const StereoSequence& sequence);

}  // namespace stereo_slam
