// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace stereo_slam {

/// The times of a file.
struct FileTimes {
  std::vector<std::int64_t> stamps_ns;
  std::string warning{};  ///< that they are not in seconds; else empty
};

/// The stamps of a file with one time a line, in seconds unless they cannot be (see unit_of_stamps): frames
/// follow each other after 1 ms to 5 s, or 2 s if all numbers are whole. Throws std::runtime_error with file
/// and line for a line that holds anything else, for times that do not increase, and for a last line that
/// seems cut off.
[[nodiscard]] FileTimes read_times(const std::filesystem::path& file);

}  // namespace stereo_slam
