// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <exception>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

namespace stereo_slam {

/// The text with '?' in place of control characters; a zero byte, for example, would end the message.
[[nodiscard]] inline std::string printable(std::string text) {
  std::ranges::replace_if(
      text, [](unsigned char c) { return c < ' ' || c == 0x7F; }, '?');
  return text;
}

/// Throws std::runtime_error with the file's path and what is wrong with it: "PATH: WHAT", printable.
[[noreturn]] inline void fail(const std::filesystem::path& file, std::string_view what) {
  throw std::runtime_error(printable(file.string() + ": " + std::string(what)));
}
template <class First, class... Rest>
[[noreturn]] void fail(const std::filesystem::path& file, fmt::format_string<First, Rest...> what,
                       First&& first, Rest&&... rest) {
  fail(file, fmt::format(what, std::forward<First>(first), std::forward<Rest>(rest)...));
}

/// "file:line: message", the form of all errors about a line; printable.
[[nodiscard]] inline std::string at_line(const std::filesystem::path& file, int line,
                                         std::string_view message) {
  return printable(fmt::format("{}:{}: {}", file.string(), line, message));
}

/// Throws std::runtime_error with at_line().
[[noreturn]] inline void fail_at(const std::filesystem::path& file, int line, std::string_view what) {
  throw std::runtime_error(at_line(file, line, what));
}
template <class First, class... Rest>
[[noreturn]] void fail_at(const std::filesystem::path& file, int line,
                          fmt::format_string<First, Rest...> what, First&& first, Rest&&... rest) {
  fail_at(file, line, fmt::format(what, std::forward<First>(first), std::forward<Rest>(rest)...));
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
