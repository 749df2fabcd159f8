// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string>

/// Names of images that say nothing about time.
namespace stereo_slam {

/// Natural order: digits compare as numbers, img9 before img10.
[[nodiscard]] bool natural_less(const std::string& a, const std::string& b);

/// A name as text and the number at its end, frame_0012 as "frame_" and 12; no number for names without one
/// and for long ones.
struct NumberedName {
  std::string text;
  std::optional<std::uint64_t> number;

  explicit NumberedName(std::string name);
};

}  // namespace stereo_slam
