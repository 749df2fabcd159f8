// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "stereo_slam/evaluation/pose_matching.hpp"
#include "stereo_slam/io/trajectory_io.hpp"

namespace stereo_slam {

/// A trajectory and the file that it was read from.
struct TrajectoryFile {
  std::filesystem::path file;
  Trajectory trajectory;
};

/// What makes the scores of an estimate mean something else than they seem to: remarks on the reading of both
/// files, different lengths or few matches, repeated stamps, poses that are the same, jumps, clocks that
/// differ, another scale, and other conventions. `pairs` are those of match_poses().
[[nodiscard]] std::vector<std::string> file_warnings(const TrajectoryFile& truth,
                                                     const TrajectoryFile& estimate, const FramePairs& pairs);

}  // namespace stereo_slam
