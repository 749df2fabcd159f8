// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string_view>

#include "stereo_slam/io/stamp_unit.hpp"

namespace stereo_slam {

/// The columns of a table that hold a stamp, a position and a quaternion; all counted from 0.
struct PoseColumns {
  std::size_t stamp = 0;                                 ///< the whole stamp, or its whole seconds
  std::optional<std::size_t> nanoseconds;                ///< the nanoseconds after these seconds
  std::optional<StampUnit> unit;                         ///< of the stamp, if its name contains it
  std::array<std::size_t, 3> position = {1, 2, 3};       ///< x, y, z
  std::array<std::size_t, 4> quaternion = {4, 5, 6, 7};  ///< w, x, y, z

  /// The smallest number of columns that a row needs.
  [[nodiscard]] std::size_t count() const;
};

/// What the names of some columns say: the columns, or the names that are missing or occur twice.
struct NamedColumns {
  std::optional<PoseColumns> columns;
  bool position = false;  ///< whether x, y and z are among the names
  std::string_view
      missing;  ///< the first column without a name: "stamp", "x" ... "qw"; empty if there is none
  std::array<std::string_view, 2> twice;  ///< two names for one column; empty if there are none
};

/// Finds the columns of a pose by their names, as spreadsheets, EuRoC, evo, TUM, ROS and pandas write them:
/// for example p_RS_R_x [m], px, tx, x, position.x, and field.pose.pose.position.x for a position, and the
/// stamp of the message's header before the time of the recording. Names of velocities, biases and standard
/// deviations are ignored.
[[nodiscard]] NamedColumns find_pose_columns(std::span<const std::string_view> names);

}  // namespace stereo_slam
