// SPDX-License-Identifier: MIT
#include "stereo_slam/io/text_file.hpp"

#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <stdexcept>
#include <system_error>

#include <fmt/format.h>

namespace stereo_slam {
namespace {

constexpr std::string_view kSeparators = " \t,\r";

std::optional<double> parse_number(std::string_view field) {
  if (field.starts_with('+')) field.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
  if (error != std::errc{} || end != field.data() + field.size() || !std::isfinite(value))
    return std::nullopt;
  return value;
}

[[nodiscard]] std::filesystem::path partial_of(const std::filesystem::path& file) {
  return file.string() + ".partial";
}

/// Writes the temporary file that is to replace `file`.
void write_partial(const std::filesystem::path& file, const std::filesystem::path& partial,
                   const std::function<void(std::ostream&)>& write) {
  std::ofstream stream(partial, std::ios::binary | std::ios::trunc);
  if (stream) write(stream);
  stream.close();
  if (stream) return;
  std::error_code ignored;
  std::filesystem::remove(partial, ignored);
  throw std::runtime_error(
      fmt::format("{}: cannot be written; check permissions and free space", file.string()));
}

}  // namespace

std::vector<TextLine> read_text_lines(const std::filesystem::path& file) {
  std::ifstream stream(file);
  if (!stream || std::filesystem::is_directory(file)) {
    throw std::runtime_error(
        fmt::format("{}: cannot be read; check the path and its permissions", file.string()));
  }
  std::vector<TextLine> lines;
  std::string text;
  for (int number = 1; std::getline(stream, text); ++number) {
    const auto first = text.find_first_not_of(kSeparators);
    if (first == std::string::npos || text[first] == '#') continue;
    if (text.back() == '\r') text.pop_back();
    lines.push_back({number, text});
  }
  return lines;
}

std::vector<std::string_view> split_fields(std::string_view text) {
  std::vector<std::string_view> fields;
  for (auto begin = text.find_first_not_of(kSeparators); begin != std::string_view::npos;) {
    const auto end = text.find_first_of(kSeparators, begin);
    fields.push_back(text.substr(begin, end - begin));
    begin = text.find_first_not_of(kSeparators, end);
  }
  return fields;
}

std::optional<std::vector<double>> parse_numbers(std::string_view text) {
  std::vector<double> numbers;
  for (const auto field : split_fields(text)) {
    const auto number = parse_number(field);
    if (!number) return std::nullopt;
    numbers.push_back(*number);
  }
  return numbers;
}

std::optional<std::int64_t> parse_seconds(std::string_view text) {
  // A mantissa of 64 bits resolves nanoseconds since 1970; where long double is double the error is below 0.2
  // us.
  if (text.starts_with('+')) text.remove_prefix(1);
  long double seconds = 0.0L;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), seconds);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  if (!(std::fabs(seconds) < 9.2e9L)) return std::nullopt;
  return static_cast<std::int64_t>(std::llround(seconds * 1e9L));
}

std::string format_seconds(std::int64_t stamp_ns) {
  const std::int64_t magnitude = std::abs(stamp_ns);
  return fmt::format("{}{}.{:09}", stamp_ns < 0 ? "-" : "", magnitude / 1'000'000'000,
                     magnitude % 1'000'000'000);
}

std::string at_line(const std::filesystem::path& file, int line, std::string_view message) {
  return fmt::format("{}:{}: {}", file.string(), line, message);
}

void write_file(const std::filesystem::path& file, const std::function<void(std::ostream&)>& write) {
  const std::filesystem::path partial = partial_of(file);
  write_partial(file, partial, write);
  std::error_code error;
  std::filesystem::rename(partial, file, error);
  if (error) {
    std::error_code ignored;
    std::filesystem::remove(partial, ignored);
    throw std::runtime_error(fmt::format("{}: cannot be written ({})", file.string(), error.message()));
  }
}

void require_writable(const std::filesystem::path& file) {
  if (std::filesystem::is_directory(file)) {
    throw std::runtime_error(fmt::format("{}: is a folder; name a file", file.string()));
  }
  const std::filesystem::path partial = partial_of(file);
  write_partial(file, partial, [](std::ostream&) {});
  std::error_code ignored;
  std::filesystem::remove(partial, ignored);
}

}  // namespace stereo_slam
