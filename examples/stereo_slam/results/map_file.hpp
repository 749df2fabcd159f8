// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>

#include "stereo_slam/loop_closing/saved_map.hpp"

/// A map as one file, readable on any machine; docs/map_file.md describes it byte by byte.
namespace stereo_slam {

/// Of the format. Header and trailer of the file are the same in all versions.
inline constexpr std::uint32_t kMapVersion = 4;

/// Whether a file that begins like this is a map.
[[nodiscard]] bool is_map(std::string_view beginning);

/// Writes the map completely or not at all; an earlier `file` stays until the new one is complete. Throws
/// std::runtime_error when it cannot be written and std::invalid_argument for a map that load_map() would
/// refuse.
void save_map(const std::filesystem::path& file, const SavedMap& map);

/// Reads a map as save_map() wrote it, bit for bit. Throws std::runtime_error with one line that names file,
/// fault and remedy: missing, not a map, another version, truncated, damaged, or contents that are
/// impossible.
[[nodiscard]] SavedMap load_map(const std::filesystem::path& file);

}  // namespace stereo_slam
