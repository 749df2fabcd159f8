// SPDX-License-Identifier: MIT
#include "stereo_slam/io/covariance_columns.hpp"

#include <array>
#include <cstddef>
#include <string_view>

#include <fmt/format.h>

namespace stereo_slam {
namespace {

/// The upper triangle of a covariance of (rotation, translation), row by row.
[[nodiscard]] std::string triangle(std::string_view prefix) {
  constexpr std::array<std::string_view, 6> kAxes = {"rx", "ry", "rz", "tx", "ty", "tz"};
  constexpr std::array<std::string_view, 3> kUnits = {"rad2", "rad_m", "m2"};
  std::string names;
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t j = i; j < 6; ++j)
      names += fmt::format(",{}{}_{}_{}", prefix, kAxes[i], kAxes[j], kUnits[i / 3 + j / 3]);
  }
  return names;
}

}  // namespace

std::string covariance_columns() {
  return "stamp_s,status" + triangle("") +
         ",keyframe,nis,nis_dof,scale_sigma,axes_sigma_rad,common_error_rad" + triangle("keyframe_") +
         ",reasons";
}

}  // namespace stereo_slam
