// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>

#include "stereo_slam/evaluation/pose_matching.hpp"
#include "stereo_slam/io/trajectory_io.hpp"

/// Whether two trajectories have the same clock.
namespace stereo_slam {

/// How long after the ground truth the estimate shows the same motion, and how well the speeds of both agree
/// with it and without it.
struct ClockOffset {
  double later = 0.0;  ///< by how much stamps of the estimate are larger: s, or frames without stamps
  double speed_error_as_given = 0.0;  ///< root mean square, as a share of the speeds: the larger one of
                                      ///< rotation and translation
  double speed_error = 0.0;           ///< the same with the offset
};

/// Compares how fast both trajectories turn and move, which no frame of reference changes, with all offsets
/// under which half of the shorter one overlaps, up to 2000 steps: of the time between two poses, or of a
/// 2000th of the estimate, whichever is longer. Nothing unless one fits clearly better than none: three times
/// as well in rotation or translation, in neither worse, and to a fifth of the speeds. Without stamps it is a
/// whole number of frames.
[[nodiscard]] std::optional<ClockOffset> find_clock_offset(const Trajectory& truth,
                                                           const Trajectory& estimate);

/// The poses of the estimate, and those of the ground truth at the same instants, interpolated.
[[nodiscard]] PosePairs poses_after(const ClockOffset& offset, const Trajectory& truth,
                                    const Trajectory& estimate);

/// One sentence: the offset, what it improves, and what to do. `poses` are as they were matched.
[[nodiscard]] std::string describe(const ClockOffset& offset, const Trajectory& truth,
                                   const Trajectory& estimate, const PosePairs& poses);

}  // namespace stereo_slam
