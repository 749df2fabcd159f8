// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <ostream>

#include "stereo_slam/loop_closing/saved_map.hpp"
#include "stereo_slam/rig/learned_cameras.hpp"

namespace stereo_slam {

/// Writes `cameras.yaml`: camera, lens error, and the coefficients of the offset with their covariances.
void write_learned_cameras(std::ostream& stream, const LearnedCameras& learned);

/// Writes them to a file. Throws std::runtime_error if it cannot be written.
void save_learned_cameras(const std::filesystem::path& file, const LearnedCameras& learned);

/// A map without keyframes, with which make_slam_system() begins.
[[nodiscard]] SavedMap as_map(const LearnedCameras& learned);

/// Reads what write_learned_cameras() wrote. Throws std::runtime_error, which names the file, the line and
/// what to do, for a file that cannot be read, is of another kind, lacks a value, or has one that no run can
/// have learned.
[[nodiscard]] LearnedCameras read_learned_cameras(const std::filesystem::path& file);

}  // namespace stereo_slam
