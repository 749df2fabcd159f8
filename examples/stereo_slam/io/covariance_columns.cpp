// SPDX-License-Identifier: MIT
#include "stereo_slam/io/covariance_columns.hpp"

#include <algorithm>
#include <array>
#include <cstddef>

#include <fmt/format.h>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/io/table_row.hpp"

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

void require_whole_columns(const std::filesystem::path& file, const TextLine& first_line) {
  const std::string usual = covariance_columns();
  const std::string earlier = usual.substr(0, usual.rfind(','));
  const std::string& columns = first_line.text;
  if (!usual.starts_with(columns) || columns == usual || columns == earlier) return;
  fail_at(file, first_line.number, "the names of the columns are cut off after '{}'; copy the file again",
          columns.substr(columns.rfind(',') + 1));
}

void require_known_status(const std::filesystem::path& file, int line, std::string_view status) {
  constexpr std::array kStatuses = {TrackingStatus::kInitializing, TrackingStatus::kOk, TrackingStatus::kWeak,
                                    TrackingStatus::kLost, TrackingStatus::kRelocalised};
  if (std::ranges::none_of(kStatuses, [status](TrackingStatus known) { return status == to_string(known); }))
    fail_at(file, line, "\"{}\" is not a status", status);
}

void require_known_reasons(const std::filesystem::path& file, int line, std::string_view reasons) {
  if (reasons.empty()) return;
  for (const auto name : split_row(reasons, ';')) {
    if (std::ranges::any_of(kWeakReasons, [&](const WeakReason& reason) { return name == reason.name; }))
      continue;
    std::string names;
    for (const auto& reason : kWeakReasons)
      names += fmt::format("{}{}", names.empty() ? "" : ", ", reason.name);
    fail_at(file, line,
            "'{}' in the column reasons is none of: {}; copy the file again, or leave the column empty", name,
            names);
  }
}

}  // namespace stereo_slam
