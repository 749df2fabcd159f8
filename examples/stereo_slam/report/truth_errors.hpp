// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <vector>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/evaluation/evaluate.hpp"
#include "stereo_slam/io/trajectory_io.hpp"
#include "stereo_slam/results/output.hpp"

namespace stereo_slam::report {

/// Errors of the poses of a run, one element a frame; NaN where the ground truth has no pose.
struct TruthErrors {
  std::vector<Vector3<double>> position_m;  ///< ground-truth positions in the world of the run
  std::vector<double> error_m;
  std::vector<double> error_rad;
  std::vector<double> nees;  ///< of the pose relative to ten frames before, if that is a keyframe; else NaN
  ErrorStatistics ate_m;
};

/// The errors of the final poses after least-squares alignment. Positions are aligned by a rigid motion.
/// Orientations are aligned by a separate rotation, because positions on a straight road do not determine the
/// rotation about the road. Nothing if fewer than three poses match.
[[nodiscard]] std::optional<TruthErrors> truth_errors(const RunRecord& record, const Trajectory& truth);

}  // namespace stereo_slam::report
