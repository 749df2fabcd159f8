// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <exception>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>

namespace stereo_slam {

/// The text with '?' in place of control characters; a zero byte, for example, would end the message.
[[nodiscard]] inline std::string printable(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c < ' ' || c == 0x7F; }, '?');
  return text;
}

/// Throws std::runtime_error with the file's path and what is wrong with it: "PATH: WHAT", printable.
[[noreturn]] inline void fail(const std::filesystem::path& file, std::string_view what) {
  throw std::runtime_error(printable(file.string() + ": " + std::string(what)));
}

/// The message of an error. For a std::filesystem error, "PATH: cannot be read (REASON); ..." replaces the
/// text of the standard library.
[[nodiscard]] inline std::string file_error_text(const std::exception& error) {
  const auto* file_error = dynamic_cast<const std::filesystem::filesystem_error*>(&error);
  if (file_error == nullptr) return error.what();
  return printable(file_error->path1().string() + ": cannot be read (" + file_error->code().message() +
                   "); check the path and its permissions");
}

}  // namespace stereo_slam
