// SPDX-License-Identifier: MIT
#include "stereo_slam/io/table_row.hpp"

#include <cstddef>

#include "stereo_slam/io/text_file.hpp"

namespace stereo_slam {
namespace {

constexpr std::string_view kRowBlanks = " \t\r";

[[nodiscard]] bool is_one_of(std::string_view text, std::size_t at, std::string_view characters) {
  return at < text.size() && characters.find(text[at]) != std::string_view::npos;
}

[[nodiscard]] std::string_view without_quotes(std::string_view text) {
  text = trimmed(text);
  if (text.size() < 2 || text.front() != '"' || text.back() != '"') return text;
  return trimmed(text.substr(1, text.size() - 2));
}

/// What blanks separate, commas included.
[[nodiscard]] std::vector<std::string_view> blank_fields(std::string_view row) {
  std::vector<std::string_view> fields;
  for (auto begin = row.find_first_not_of(kRowBlanks); begin != std::string_view::npos;) {
    const auto end = row.find_first_of(kRowBlanks, begin);
    fields.push_back(row.substr(begin, end - begin));
    begin = row.find_first_not_of(kRowBlanks, end);
  }
  return fields;
}

}  // namespace

char separator_of(std::string_view row) {
  for (const char separator : {';', ','}) {
    if (row.find(separator) != std::string_view::npos) return separator;
  }
  return ' ';
}

std::vector<std::string_view> split_row(std::string_view row, char separator) {
  std::vector<std::string_view> fields;
  if (separator == ' ') {
    for (const auto field : blank_fields(row)) fields.push_back(without_quotes(field));
    return fields;
  }
  bool quoted = false;
  std::size_t begin = 0;
  for (std::size_t i = 0; i <= row.size(); ++i) {
    if (i < row.size() && row[i] == '"') quoted = !quoted;
    if (i < row.size() && (quoted || row[i] != separator)) continue;
    fields.push_back(without_quotes(row.substr(begin, i - begin)));
    begin = i + 1;
  }
  return fields;
}

bool has_decimal_commas(std::string_view row) {
  constexpr std::string_view kDigits = "0123456789";
  const bool semicolons = row.find(';') != std::string_view::npos;
  const auto fields = semicolons ? split_row(row, ';') : blank_fields(row);
  std::size_t count = 0;
  for (const auto field : fields) {
    const auto comma = field.find(',');
    if (comma == std::string_view::npos) continue;
    if (field.find(',', comma + 1) != std::string_view::npos) return false;
    if (comma > 0 && is_one_of(field, comma - 1, kDigits) && is_one_of(field, comma + 1, kDigits)) ++count;
  }
  return count > 0 && fields.size() > 1;
}

}  // namespace stereo_slam
