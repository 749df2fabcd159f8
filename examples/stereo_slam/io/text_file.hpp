// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

/// Text in and out, with errors that name file and line. Numbers are read and written independently of the
/// locale.
namespace stereo_slam {

/// A line of a text file; numbers start at 1.
struct TextLine {
  int number = 0;
  std::string text;
};

/// The lines of a file without blank lines, comments (lines that start with '#') and carriage returns. Throws
/// std::runtime_error when the file cannot be read.
[[nodiscard]] std::vector<TextLine> read_text_lines(const std::filesystem::path& file);

/// All numbers of a line, separated by blanks or commas; nothing if any field is not a finite number.
[[nodiscard]] std::optional<std::vector<double>> parse_numbers(std::string_view text);

/// Converts decimal seconds to nanoseconds, exactly (a double resolves current stamps only to 0.2 us).
/// Nothing if the text is not a number of at most 292 years.
[[nodiscard]] std::optional<std::int64_t> parse_seconds(std::string_view text);

/// Nanoseconds as decimal seconds, "12.345678900".
[[nodiscard]] std::string format_seconds(std::int64_t stamp_ns);

/// Fields of a line, separated by blanks or commas.
[[nodiscard]] std::vector<std::string_view> split_fields(std::string_view text);

/// "file:line: message", the form of all errors about a line.
[[nodiscard]] std::string at_line(const std::filesystem::path& file, int line, std::string_view message);

/// Writes a file completely or not at all: `write` fills a temporary file beside it, which replaces `file`
/// once it is on disk. Throws std::runtime_error when that fails.
void write_file(const std::filesystem::path& file, const std::function<void(std::ostream&)>& write);

/// Throws std::runtime_error if write_file() would fail for `file`, as far as this can be checked beforehand.
void require_writable(const std::filesystem::path& file);

}  // namespace stereo_slam
