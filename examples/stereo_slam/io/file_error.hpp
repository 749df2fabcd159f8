// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>

namespace stereo_slam {

/// Throws std::runtime_error with the file's path and what is wrong with it: "PATH: WHAT".
[[noreturn]] inline void fail(const std::filesystem::path& file, std::string_view what) {
  throw std::runtime_error(file.string() + ": " + std::string(what));
}

}  // namespace stereo_slam
