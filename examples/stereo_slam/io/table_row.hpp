// SPDX-License-Identifier: MIT
#pragma once

#include <string_view>
#include <vector>

/// Rows of a table of text, with the separators of any spreadsheet.
namespace stereo_slam {

/// What separates the fields of a row: a semicolon or a comma if it contains one, otherwise blanks.
[[nodiscard]] char separator_of(std::string_view row);

/// The fields of a row, without the blanks and the double quotes around them. Semicolons, commas and tabs
/// separate one by one, so that a field may be empty, and not between quotes. Blanks (the separator ' ',
/// which includes tabs) separate however many they are.
[[nodiscard]] std::vector<std::string_view> split_row(std::string_view row, char separator);

/// Whether the numbers of a row have decimal commas: blanks or semicolons separate its fields, some fields
/// have a comma between digits, and none has two.
[[nodiscard]] bool has_decimal_commas(std::string_view row);

}  // namespace stereo_slam
