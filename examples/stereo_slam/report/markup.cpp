// SPDX-License-Identifier: MIT
#include "stereo_slam/report/markup.hpp"

namespace stereo_slam::report {
namespace {

/// The entity of a character; empty if it needs none.
[[nodiscard]] std::string_view entity(char character) {
  switch (character) {
    case '&':
      return "&amp;";
    case '<':
      return "&lt;";
    case '>':
      return "&gt;";
    case '"':
      return "&quot;";
    case '\'':
      return "&#39;";
    default:
      return {};
  }
}

[[nodiscard]] bool is_control(char character) {
  const auto code = static_cast<unsigned char>(character);
  return (code < 0x20 && character != '\t' && character != '\n') || code == 0x7f;
}

}  // namespace

std::string escape_markup(std::string_view text) {
  std::string result;
  for (const char character : text) {
    if (const auto name = entity(character); !name.empty()) {
      result += name;
    } else if (is_control(character)) {
      result += "\uFFFD";
    } else {
      result += character;
    }
  }
  return result;
}

}  // namespace stereo_slam::report
