// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

namespace stereo_slam {

/// The stamps of a file with one time in seconds a line. Throws std::runtime_error with file and line for a
/// line that holds anything else, for times that do not increase, and for a last line that seems cut off.
[[nodiscard]] std::vector<std::int64_t> read_times(const std::filesystem::path& file);

}  // namespace stereo_slam
