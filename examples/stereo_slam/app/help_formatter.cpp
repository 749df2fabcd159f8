// SPDX-License-Identifier: MIT
#include "stereo_slam/app/help_formatter.hpp"

#include <cstddef>
#include <sstream>

namespace stereo_slam {
namespace {

constexpr std::size_t kNameColumns = 30;
constexpr std::size_t kColumns = 100;

}  // namespace

HelpFormatter::HelpFormatter() { column_width(kNameColumns); }

/// The name of an option without "{false}", which CLI11 appends to the names of negated flags.
std::string HelpFormatter::make_option_name(const CLI::Option* option, bool is_positional) const {
  std::string name = CLI::Formatter::make_option_name(option, is_positional);
  for (std::size_t at = 0; (at = name.find('{')) != std::string::npos;)
    name.erase(at, name.find('}', at) - at + 1);
  return name;
}

std::string HelpFormatter::make_option_desc(const CLI::Option* option) const {
  std::istringstream words(CLI::Formatter::make_option_desc(option));
  std::string text;
  std::string word;
  for (std::size_t column = 0; words >> word; column += word.size()) {
    const bool fits = column + 1 + word.size() <= kColumns - kNameColumns;
    if (!text.empty()) {
      text += fits ? ' ' : '\n';
      column = fits ? column + 1 : 0;
    }
    text += word;
  }
  return text;
}

}  // namespace stereo_slam
