// SPDX-License-Identifier: MIT
#include "stereo_slam/io/text_file.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include <fmt/format.h>

#include "stereo_slam/io/file_error.hpp"
#include "stereo_slam/io/input_file.hpp"

namespace stereo_slam {
namespace {

constexpr std::string_view kSeparators = " \t,\r";
constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";  // of UTF-8, as some editors write it

std::optional<double> parse_number(std::string_view field) {
  if (field.starts_with('+')) field.remove_prefix(1);
  double value = 0.0;
  const char* const field_end = field.data() + field.size();
  auto [end, error] = std::from_chars(field.data(), field_end, value);
  if (error == std::errc::result_out_of_range) {  // also of 1e-400, which is zero
    long double wide = 0.0L;
    error = std::from_chars(field.data(), field_end, wide).ec;
    value = static_cast<double>(wide);
  }
  if (error != std::errc{} || end != field_end || !std::isfinite(value)) return std::nullopt;
  return value;
}

/// Whether a number has fewer characters after its point than another one, or fewer at all if neither has
/// one.
bool is_shorter(std::string_view number, std::string_view other) {
  const auto after_point = [](std::string_view text) {
    const auto point = text.find('.');
    return point == std::string_view::npos ? 0 : text.size() - point;
  };
  if (after_point(number) == 0 && after_point(other) == 0) return number.size() < other.size();
  return after_point(number) < after_point(other);
}

}  // namespace

std::vector<TextLine> read_text_lines(const std::filesystem::path& file, Comments comments) {
  const std::string content = read_file(file, kMostTextBytes);
  std::vector<TextLine> lines;
  std::string_view rest = content;
  if (rest.starts_with(kByteOrderMark)) rest.remove_prefix(kByteOrderMark.size());
  require_no_zero_byte(file, rest);
  for (int number = 1; !rest.empty(); ++number) {
    if (number > kMostLines) {
      fail(file, "has more than {} lines; check which file it is, or divide it", kMostLines);
    }
    const auto end = rest.find('\n');
    const bool ended = end != std::string_view::npos;
    auto text = rest.substr(0, end);
    rest.remove_prefix(ended ? end + 1 : rest.size());
    if (text.size() > kMostLineBytes) {
      fail_at(file, number, "the line has {} bytes, more than {}; check that it is a text file", text.size(),
              kMostLineBytes);
    }
    const auto first = text.find_first_not_of(kSeparators);
    if (first == std::string_view::npos) continue;
    if (text[first] == '#' && comments == Comments::kLeftOut) continue;
    if (text.back() == '\r') text.remove_suffix(1);
    lines.push_back({number, std::string(text), ended});
  }
  return lines;
}

void require_no_zero_byte(const std::filesystem::path& file, std::string_view text) {
  const auto zero = text.find('\0');
  if (zero == std::string_view::npos) return;
  const auto line = 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(zero), '\n');
  fail_at(file, static_cast<int>(line),
          "there is a zero byte, so it is no text file in UTF-8, or it is damaged; check which file it is, "
          "or convert it");
}

void require_whole_last_line(const std::filesystem::path& file, const std::vector<TextLine>& lines) {
  if (lines.size() < 2 || lines.back().ended) return;
  const auto last = split_fields(lines.back().text);
  const auto before = split_fields(lines[lines.size() - 2].text);
  if (last.size() > before.size()) return;
  if (last.size() == before.size() && (last.empty() || !is_shorter(last.back(), before.back()))) return;
  fail_at(file, lines.back().number,
          "the last line has no line end and fewer digits than the one before; it may be cut off: copy the "
          "file again, or add the line end");
}

void require_line_end(const std::filesystem::path& file, const std::vector<TextLine>& lines) {
  if (lines.empty() || lines.back().ended) return;
  fail_at(
      file, lines.back().number,
      "the last line has no line end, so digits may be missing; copy the file again, or add the line end");
}

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r";
  const auto first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

std::string lower_case(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return lower;
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

std::optional<std::int64_t> parse_nanoseconds(std::string_view text) {
  std::int64_t stamp_ns = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), stamp_ns);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  if (stamp_ns < -kLatestStamp_ns || stamp_ns > kLatestStamp_ns) return std::nullopt;
  return stamp_ns;
}

std::optional<std::int64_t> parse_seconds(std::string_view text) {
  // A long double with a mantissa of 64 bits resolves nanoseconds since 1970. Where long double is double,
  // the error is below 0.2 us.
  if (text.starts_with('+')) text.remove_prefix(1);
  long double seconds = 0.0L;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), seconds);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  if (!(std::fabs(seconds) <= 1e-9L * kLatestStamp_ns)) return std::nullopt;
  return static_cast<std::int64_t>(std::llround(seconds * 1e9L));
}

std::string format_seconds(std::int64_t stamp_ns) {
  const std::int64_t magnitude = std::abs(stamp_ns);
  return fmt::format("{}{}.{:09}", stamp_ns < 0 ? "-" : "", magnitude / 1'000'000'000,
                     magnitude % 1'000'000'000);
}

}  // namespace stereo_slam
