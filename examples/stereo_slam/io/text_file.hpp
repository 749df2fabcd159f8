// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "stereo_slam/io/file_error.hpp"

/// Text files. Errors name file and line. Numbers are read and written independently of the locale.
namespace stereo_slam {

/// A line of a text file; numbers start at 1.
struct TextLine {
  int number = 0;
  std::string text;
  bool ended = true;  ///< false for a last line without a line end
};

/// Largest size of a text file and of one of its lines, and the largest number of lines.
constexpr std::size_t kMostTextBytes = std::size_t{256} << 20;
constexpr std::size_t kMostLineBytes = std::size_t{64} << 10;
constexpr int kMostLines = 1'000'000;

/// What becomes of comments, which are lines that start with '#'.
enum class Comments { kLeftOut, kKept };

/// The lines of a file. Blank lines and comments are left out; carriage returns at line ends and a byte order
/// mark are removed. Throws std::runtime_error when the file cannot be read, as read_file() does, for a
/// longer file or line than the bounds above, and for a byte that is zero.
[[nodiscard]] std::vector<TextLine> read_text_lines(const std::filesystem::path& file,
                                                    Comments comments = Comments::kLeftOut);

/// All numbers of a line, separated by blanks or commas; nothing if any field is not a finite number.
[[nodiscard]] std::optional<std::vector<double>> parse_numbers(std::string_view text);

/// Largest stamp, 126 years. Stamps beyond it before or after 1970 are refused, so that differences of stamps
/// do not overflow.
constexpr std::int64_t kLatestStamp_ns = 4'000'000'000'000'000'000;

/// Reads whole nanoseconds up to kLatestStamp_ns; nothing if the text is anything else.
[[nodiscard]] std::optional<std::int64_t> parse_nanoseconds(std::string_view text);

/// Converts decimal seconds to nanoseconds, exactly (a double resolves current stamps only to 0.2 us).
/// Nothing if the text is not a number, or beyond kLatestStamp_ns.
[[nodiscard]] std::optional<std::int64_t> parse_seconds(std::string_view text);

/// Nanoseconds as decimal seconds, "12.345678900".
[[nodiscard]] std::string format_seconds(std::int64_t stamp_ns);

/// The text without blanks, tabs and carriage returns at its ends.
[[nodiscard]] std::string_view trimmed(std::string_view text);

/// The text in lower case; letters outside ASCII stay as they are.
[[nodiscard]] std::string lower_case(std::string_view text);

/// Fields of a line, separated by blanks or commas.
[[nodiscard]] std::vector<std::string_view> split_fields(std::string_view text);

/// Throws std::runtime_error with the line if the file's text has a byte that is zero.
void require_no_zero_byte(const std::filesystem::path& file, std::string_view text);

/// Throws std::runtime_error if the last line has no line end, and fewer fields than the line before or fewer
/// digits in the last one: it may be cut off. A missing line end alone is common.
void require_whole_last_line(const std::filesystem::path& file, const std::vector<TextLine>& lines);

/// Throws std::runtime_error if the last line has no line end, for files that the program itself writes.
void require_line_end(const std::filesystem::path& file, const std::vector<TextLine>& lines);

}  // namespace stereo_slam
