// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace stereo_slam {

/// What is in a folder, for a message that something else is not: "Left/, Right/, both.avi and 12 more".
/// Folders come first, each group by name; hidden files are left out. Empty if there is nothing, or the
/// folder cannot be read.
[[nodiscard]] std::string names_in(const std::filesystem::path& folder);

/// The folders in a folder, by name, a hundred at most; hidden ones are left out. Empty if the folder cannot
/// be read.
[[nodiscard]] std::vector<std::filesystem::path> folders_in(const std::filesystem::path& folder);

}  // namespace stereo_slam
