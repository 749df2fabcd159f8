// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace stereo_slam {

/// The content of a regular file, or of a pipe that the program was started with, such as /dev/stdin or
/// bash's <(...). Throws std::runtime_error that names the file when it cannot be read or has more than
/// `most_bytes`, and for folders, devices and other pipes, without waiting until somebody writes to them.
[[nodiscard]] std::string read_file(const std::filesystem::path& file, std::size_t most_bytes);

}  // namespace stereo_slam
