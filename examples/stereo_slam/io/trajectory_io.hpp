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

/// Poses T_world_body, in order of time. Matrices are kept as they stand in a KITTI file, rounding of the
/// rotation included: the benchmark's scores are defined on them, and normalising shows in the fourth digit.
struct Trajectory {
  TrajectoryFormat format = TrajectoryFormat::kKitti;
  std::vector<std::int64_t> stamps_ns;  ///< never decreasing, one a pose; empty when the format has none
  std::vector<Eigen::Isometry3d> poses;
};

/// Reads a trajectory; without a format the first line tells it (12 numbers, 8 blank-separated, 8 or more
/// with commas). Throws std::runtime_error naming file, line and what was wrong.
[[nodiscard]] Trajectory read_trajectory(const std::filesystem::path& file,
                                         std::optional<TrajectoryFormat> format = std::nullopt);

/// One row-major 3x4 matrix [R | t] a line.
void write_kitti_trajectory(std::ostream& stream, std::span<const Pose> poses);

/// "stamp tx ty tz qx qy qz qw", seconds; one stamp a pose.
void write_tum_trajectory(std::ostream& stream, std::span<const std::int64_t> stamps_ns,
                          std::span<const Pose> poses);

}  // namespace stereo_slam
