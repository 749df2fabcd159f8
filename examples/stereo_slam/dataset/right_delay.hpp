// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <vector>

#include "stereo_slam/dataset/camera_from_motion.hpp"

/// @file
/// Whether the right images were taken later than the left ones. A point lies in one row of both images of a
/// rectified pair. If the right image is later by a part t of the time between two frames, and the row of the
/// point changes by m from frame to frame, the rows differ by t m. A rotation of the right camera, which may
/// differ from frame to frame if the rig vibrates, changes rows in other ways: by a constant, by x and by x
/// y. So do other errors of the rectification, and a radial distortion that both images still have.
namespace stereo_slam {

/// A delay of the right images, in units of the time between two frames.
struct RightDelay {
  double frames = 0.0;   ///< negative if they are early
  double sigma = 0.0;    ///< standard deviation of it
  double rows_px = 0.0;  ///< by how much it changes rows: the median
  double rest_px = 0.0;  ///< by how much they differ besides

  /// Whether the images show clearly that they are not of one moment.
  [[nodiscard]] bool is_clear() const;
  /// Whether a run should take the delay into account, which it then measures better: a smaller one, too.
  [[nodiscard]] bool is_likely() const;
  /// Whether it is nearer to half of the time between two frames than to all of it: pairs are not shifted.
  [[nodiscard]] bool is_part_of_a_frame() const;
  /// Whether it is worth to look closer, in pairs of neighbouring frames: they tell it twice as well.
  [[nodiscard]] bool is_possible() const;
};

/// The delay within half the time between two frames that fits the rows of the points best, of which some are
/// wrong. `gap` is the number of frames from the first to the second frame of each pair. Nothing if there are
/// fewer than 100 points.
[[nodiscard]] std::optional<RightDelay> right_delay(const StereoCamera& camera,
                                                    const std::vector<std::vector<MovedPoint>>& pairs,
                                                    std::size_t gap);

/// Whether no pair by itself shows another delay: in some of them the right image may be of another frame.
[[nodiscard]] bool all_pairs_share(const RightDelay& delay, const StereoCamera& camera,
                                   const std::vector<std::vector<MovedPoint>>& pairs, std::size_t gap);

}  // namespace stereo_slam
