// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>

namespace stereo_slam {

/// The text with '?' in place of control characters: a zero byte would end the message.
[[nodiscard]] inline std::string printable(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c < ' ' || c == 0x7F; }, '?');
  return text;
}

/// Throws std::runtime_error with the file's path and what is wrong with it: "PATH: WHAT", printable.
[[noreturn]] inline void fail(const std::filesystem::path& file, std::string_view what) {
  throw std::runtime_error(printable(file.string() + ": " + std::string(what)));
}

}  // namespace stereo_slam
