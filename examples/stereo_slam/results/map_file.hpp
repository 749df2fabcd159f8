// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>

#include "stereo_slam/loop_closing/saved_map.hpp"

/// A map as one file, readable on any machine; docs/map_file.md describes it byte by byte.
namespace stereo_slam {

/// Writes the map whole or not at all; what was at `file` before stays until then. Throws std::runtime_error
/// when it cannot be written, std::invalid_argument for a map that load_map() would refuse.
void save_map(const std::filesystem::path& file, const SavedMap& map);

/// Reads back what save_map() wrote, bit for bit. Throws std::runtime_error with one line, file first, that
/// says what to do: no such file, no map, another version, truncated, damaged, or contents no run leaves.
[[nodiscard]] SavedMap load_map(const std::filesystem::path& file);

}  // namespace stereo_slam
