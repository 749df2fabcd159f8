// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>

#include <fmt/format.h>

namespace stereo_slam {

/// A number as JSON, and null where there is none.
template <class Number>
[[nodiscard]] std::string json_value(const std::optional<Number>& value) {
  return value ? fmt::format("{}", *value) : "null";
}

}  // namespace stereo_slam
