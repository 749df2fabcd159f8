// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include <fmt/format.h>

namespace stereo_slam {

/// A number with what it counts: "1 frame", "2 frames". `several` is for other words than `one` with an s:
/// "1 pose has", "2 poses have".
[[nodiscard]] inline std::string counted(std::size_t count, std::string_view one,
                                         std::string_view several = "") {
  if (count == 1) return fmt::format("1 {}", one);
  return several.empty() ? fmt::format("{} {}s", count, one) : fmt::format("{} {}", count, several);
}

}  // namespace stereo_slam
