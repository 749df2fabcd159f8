// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace stereo_slam {

/// The content of an ordinary file. Besides these, only a pipe that the program was started with
/// is read, such as /dev/stdin or bash's <(...). Throws std::runtime_error that names the file when it cannot
/// be read, is a folder, a device or a pipe by another name, or has more than `most_bytes`; at once, without
/// waiting for anybody to write.
[[nodiscard]] std::string read_file(const std::filesystem::path& file, std::size_t most_bytes);

}  // namespace stereo_slam
