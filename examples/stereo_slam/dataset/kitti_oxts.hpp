// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string_view>
#include <vector>

#include <Eigen/Geometry>

/// The files of KITTI's raw data besides images.
namespace stereo_slam {

/// The stamps of timestamps.txt, "2011-09-26 13:02:25.964389445" a line, by the index of the line from 0.
/// Blank lines have no stamp. Throws std::runtime_error with file and line for any other text.
[[nodiscard]] std::map<std::size_t, std::int64_t> read_kitti_stamps(const std::filesystem::path& file);

/// The stamp of such a line; nothing for any other text.
[[nodiscard]] std::optional<std::int64_t> stamp_of_date(std::string_view text);

/// Poses of the IMU.
struct OxtsPoses {
  std::vector<std::int64_t> stamps_ns;         ///< increase
  std::vector<Eigen::Isometry3d> T_world_imu;  ///< the first is the identity
  std::size_t out_of_order = 0;  ///< packets that were left out because their stamp is not later
};

/// The poses in oxts/data/*.txt by the convention of the development kit: a Mercator projection with the
/// scale of the first latitude, and R = Rz(yaw) Ry(pitch) Rx(roll). Throws std::runtime_error that names the
/// file.
[[nodiscard]] OxtsPoses read_oxts(const std::filesystem::path& folder);

}  // namespace stereo_slam
