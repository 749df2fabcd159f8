// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <ostream>
#include <span>
#include <string_view>
#include <vector>

#include <Eigen/Geometry>

#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// kKitti: row-major 3x4 [R | t] a line, no stamps. kTum: "stamp tx ty tz qx qy qz qw", seconds.
/// kEuroc: "stamp,px,py,pz,qw,qx,qy,qz[,...]", nanoseconds.
enum class TrajectoryFormat { kKitti, kTum, kEuroc };

[[nodiscard]] std::string_view to_string(TrajectoryFormat format) noexcept;

/// Poses T_world_body, in order of time. Rotation matrices of a KITTI file are not normalised:
/// the benchmark's scores are defined on the rounded matrices, and normalising changes the fourth digit.
struct Trajectory {
  TrajectoryFormat format = TrajectoryFormat::kKitti;
  std::vector<std::int64_t> stamps_ns;  ///< not decreasing, one per pose; empty if the format has none
  std::vector<Eigen::Isometry3d> poses;
};

/// Reads a trajectory. Without `format` the first line determines it: 12 numbers (KITTI), 8 separated by
/// blanks (TUM), otherwise 8 or more with commas (EuRoC). Throws std::runtime_error that names file, line and
/// error.
[[nodiscard]] Trajectory read_trajectory(const std::filesystem::path& file,
                                         std::optional<TrajectoryFormat> format = std::nullopt);

/// Writes one row-major 3x4 matrix [R | t] per line.
void write_kitti_trajectory(std::ostream& stream, std::span<const Pose> poses);

/// Writes "stamp tx ty tz qx qy qz qw" per line, in seconds; `stamps_ns` has one stamp per pose.
void write_tum_trajectory(std::ostream& stream, std::span<const std::int64_t> stamps_ns,
                          std::span<const Pose> poses);

}  // namespace stereo_slam
