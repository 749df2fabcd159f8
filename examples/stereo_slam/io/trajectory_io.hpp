// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <ostream>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Geometry>

#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// kKitti: row-major 3x4 [R | t] a line. kTum: "stamp tx ty tz qx qy qz qw", seconds.
/// kEuroc: "stamp,px,py,pz,qw,qx,qy,qz[,...]", nanoseconds. Names of the columns and the size of the stamps
/// take precedence.
enum class TrajectoryFormat { kKitti, kTum, kEuroc };

[[nodiscard]] std::string_view to_string(TrajectoryFormat format) noexcept;

/// Poses T_world_body, in order of time. Rotation matrices of a KITTI file are not normalised:
/// the benchmark's scores are defined on the rounded matrices, and normalising changes the fourth digit.
struct Trajectory {
  TrajectoryFormat format = TrajectoryFormat::kKitti;
  std::vector<std::int64_t> stamps_ns;  ///< not decreasing, one per pose; empty if the format has none
  std::vector<Eigen::Isometry3d> poses;
  std::vector<std::int64_t> frames = {};  ///< increasing numbers of the frames; empty: 0, 1, 2 ..., or stamps
  std::vector<std::string> remarks = {};  ///< what the user should know about the reading of the file
};

/// Reads a trajectory. If a line before the first pose names all columns that are needed, these are read.
/// Otherwise `format` tells what they are, or the first pose does: a rotation matrix (KITTI; also 4x4, and
/// after a frame's number or a stamp), or 8 or more numbers, separated by blanks (TUM) or not (EuRoC). Stamps
/// may have any unit; unit_of_stamps() finds it. Throws std::runtime_error that names file, line and error.
[[nodiscard]] Trajectory read_trajectory(const std::filesystem::path& file,
                                         std::optional<TrajectoryFormat> format = std::nullopt);

/// Writes one row-major 3x4 matrix [R | t] per line.
void write_kitti_trajectory(std::ostream& stream, std::span<const Pose> poses);

/// Writes "stamp tx ty tz qx qy qz qw" per line, in seconds; `stamps_ns` has one stamp per pose.
void write_tum_trajectory(std::ostream& stream, std::span<const std::int64_t> stamps_ns,
                          std::span<const Pose> poses);

}  // namespace stereo_slam
