// SPDX-License-Identifier: MIT
#include "stereo_slam/stamps/name_times.hpp"

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <optional>
#include <set>
#include <stdexcept>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "stereo_slam/stamps/calendar.hpp"
#include "stereo_slam/stamps/stamp_units.hpp"

namespace stereo_slam {
namespace {

constexpr std::string_view kDecimalDigits = "0123456789";

/// A name as the numbers in it and the texts around them.
struct DividedName {
  std::vector<std::string> texts{""};  ///< one more than numbers
  std::vector<WrittenNumber> numbers;
};

DividedName divide(const std::string& name) {
  DividedName divided;
  const auto digits_from = [&](std::size_t at) {
    return name.substr(at, std::min(name.find_first_not_of(kDecimalDigits, at), name.size()) - at);
  };
  for (std::size_t at = 0; at < name.size();) {
    const std::string whole = digits_from(at);
    if (whole.empty()) {
      divided.texts.back() += name[at++];
      continue;
    }
    at += whole.size();
    const bool has_point = at < name.size() && (name[at] == '.' || name[at] == ',');
    const std::string fraction = has_point ? digits_from(at + 1) : "";
    if (!fraction.empty()) at += 1 + fraction.size();
    divided.numbers.push_back({whole, fraction});
    divided.texts.emplace_back();
  }
  return divided;
}

/// The names of a folder, which differ in their numbers only.
class NameTable {
 public:
  /// Empty if the texts differ.
  explicit NameTable(const std::vector<std::string>& names) {
    for (const auto& name : names) {
      rows_.push_back(divide(name));
      if (rows_.back().texts == rows_.front().texts) continue;
      rows_.clear();
      return;
    }
  }

  [[nodiscard]] std::size_t rows() const { return rows_.size(); }
  [[nodiscard]] std::size_t columns() const { return rows_.empty() ? 0 : rows_.front().numbers.size(); }
  [[nodiscard]] const DividedName& row(std::size_t i) const { return rows_.at(i); }

  [[nodiscard]] std::vector<WrittenNumber> column(std::size_t k) const {
    std::vector<WrittenNumber> numbers;
    numbers.reserve(rows_.size());
    for (const auto& row : rows_) numbers.push_back(row.numbers.at(k));
    return numbers;
  }

  [[nodiscard]] bool varies(std::size_t k) const {
    const auto& first = rows_.front().numbers.at(k);
    return rows_.size() == 1 || std::ranges::any_of(rows_, [&](const DividedName& row) {
             return row.numbers[k].whole != first.whole || row.numbers[k].fraction != first.fraction;
           });
  }

  /// Whether one character divides a number from the number before it.
  [[nodiscard]] bool follows(std::size_t k) const {
    return k > 0 && k < columns() && rows_.front().texts[k].size() == 1;
  }

 private:
  std::vector<DividedName> rows_;
};

/// Columns that may be the time, from `first` to before `end`, as one number a name.
struct TimeField {
  std::size_t first = 0;
  std::size_t end = 0;
  std::vector<WrittenNumber> numbers{};
  bool is_clock = false;     ///< a date or seconds since 1970
  bool is_combined = false;  ///< the fraction of the second is a column of its own
};

/// Adds the column after the field as the fraction of a second, if it may be one.
void add_fraction(const NameTable& table, TimeField& field) {
  constexpr std::size_t kMostDigits = 9;
  const bool has_fraction =
      std::ranges::any_of(field.numbers, [](const auto& number) { return !number.fraction.empty(); });
  if (has_fraction || !table.follows(field.end) || !table.varies(field.end)) return;
  const auto fractions = table.column(field.end);
  for (const auto& [whole, fraction] : fractions) {
    if (!fraction.empty() || whole.size() > kMostDigits) return;
  }
  for (std::size_t i = 0; i < fractions.size(); ++i) field.numbers[i].fraction = fractions[i].whole;
  field.end += 1;
  field.is_combined = true;
}

/// The date and time of day that begins in a column, YYYYMMDDhhmmss with or without anything between them.
std::optional<TimeField> date_at(const NameTable& table, std::size_t first) {
  constexpr std::size_t kDigits = 14;
  TimeField field{.first = first, .is_clock = true};
  for (std::size_t i = 0; i < table.rows(); ++i) {
    const auto& row = table.row(i);
    std::string digits;
    std::size_t k = first;
    for (; k < row.numbers.size() && digits.size() < kDigits; ++k) {
      const bool divided = k == first || row.texts[k].size() == 1;
      const bool is_last = digits.size() + row.numbers[k].whole.size() >= kDigits;
      if (!divided || (!is_last && !row.numbers[k].fraction.empty())) return std::nullopt;
      digits += row.numbers[k].whole;
    }
    const auto seconds = seconds_of_date(std::string_view(digits).substr(0, kDigits));
    if (!seconds || (field.end != 0 && field.end != k)) return std::nullopt;
    field.end = k;
    std::string fraction = digits.substr(kDigits);
    if (!fraction.empty() && !row.numbers[k - 1].fraction.empty()) return std::nullopt;
    field.numbers.push_back({std::to_string(*seconds), fraction + row.numbers[k - 1].fraction});
  }
  add_fraction(table, field);
  return field;
}

/// The numbers of one column, or of two if the first is in seconds since 1970.
TimeField number_at(const NameTable& table, std::size_t first) {
  constexpr std::size_t kSecondsDigits = 10;
  constexpr std::string_view kFrom1990 = "0631152000";
  TimeField field{.first = first, .end = first + 1, .numbers = table.column(first)};
  field.is_clock = std::ranges::all_of(field.numbers, [&](const auto& number) {
    return number.whole.size() >= kSecondsDigits && number.whole.front() != '0';
  });
  const bool seconds = std::ranges::all_of(field.numbers, [&](const auto& number) {
    return number.whole.size() == kSecondsDigits && number.whole > kFrom1990;
  });
  if (seconds) add_fraction(table, field);
  return field;
}

/// Order of the rows by their keys.
std::vector<std::size_t> order_by(const std::vector<std::int64_t>& keys) {
  std::vector<std::size_t> order(keys.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, [&](std::size_t a, std::size_t b) { return keys[a] < keys[b]; });
  return order;
}

/// The values of a column that counts the images, each once; empty if it does not.
std::vector<std::int64_t> counted(const std::vector<WrittenNumber>& column) {
  constexpr std::int64_t kMostGaps = 10;  // times the images
  std::vector<std::int64_t> values;
  for (const auto& number : column) {
    std::int64_t value = 0;
    const char* const end = number.whole.data() + number.whole.size();
    const auto [stop, error] = std::from_chars(number.whole.data(), end, value);
    if (!number.fraction.empty() || error != std::errc{} || stop != end) return {};
    values.push_back(value);
  }
  const std::set<std::int64_t> distinct(values.begin(), values.end());
  const auto count = static_cast<std::int64_t>(values.size());
  if (distinct.size() != values.size() || *distinct.rbegin() - *distinct.begin() >= kMostGaps * count)
    return {};
  return values;
}

/// Two names, as indices, that the other columns count in another order than the keys; nothing if there are
/// none.
std::optional<std::pair<std::size_t, std::size_t>> contradiction(const NameTable& table,
                                                                 const TimeField& field,
                                                                 const std::vector<std::int64_t>& keys) {
  const auto order = order_by(keys);
  for (std::size_t k = 0; k < table.columns(); ++k) {
    if (k >= field.first && k < field.end) continue;
    const auto count = counted(table.column(k));
    if (count.empty()) continue;
    for (std::size_t i = 1; i < order.size(); ++i) {
      if (count[order[i]] < count[order[i - 1]]) return std::pair(order[i - 1], order[i]);
    }
  }
  return std::nullopt;
}

/// Whether the column after the seconds is a fraction of a second, and no counter of images: it is if images
/// around a full second are as far apart as others, and if it does not count by one within a second.
bool is_fraction(std::vector<std::int64_t> stamps_ns, const std::vector<std::int64_t>& count) {
  constexpr std::int64_t kSecond_ns = 1'000'000'000;
  constexpr std::int64_t kTolerance = 4;  // a quarter of the usual interval
  const std::int64_t usual_ns = usual_interval_ns(stamps_ns);
  if (!is_usual_interval(usual_ns)) return false;
  std::ranges::sort(stamps_ns);
  if (std::ranges::adjacent_find(stamps_ns) != stamps_ns.end()) return false;
  std::size_t crossings = 0;
  std::size_t odd = 0;
  for (std::size_t i = 1; i < stamps_ns.size(); ++i) {
    if (stamps_ns[i] / kSecond_ns == stamps_ns[i - 1] / kSecond_ns) continue;
    ++crossings;
    const std::int64_t interval_ns = stamps_ns[i] - stamps_ns[i - 1];
    odd += std::abs(interval_ns - usual_ns) > usual_ns / kTolerance ? 1 : 0;
  }
  if (crossings > 0) return 2 * odd <= crossings;
  const auto [least, most] = std::ranges::minmax_element(count);
  return count.empty() || *most - *least >= 2 * static_cast<std::int64_t>(count.size());
}

/// Throws if what is before a number from zero may be its sign.
void require_no_sign(const NameTable& table, const TimeField& field, const std::vector<std::string>& names) {
  const std::string& before = table.row(0).texts[field.first];
  if (before != "-" && !before.ends_with("_-")) return;
  throw std::invalid_argument(fmt::format(
      "{} may be a negative time; rename the images with times from zero or since 1970", names.front()));
}

/// The times of a field; nothing if it has none, or if the rest of the names speaks against it.
std::optional<NameTimes> times_of(const NameTable& table, const TimeField& field,
                                  const std::vector<std::string>& names) {
  std::size_t varying = 0;
  for (std::size_t k = 0; k < table.columns(); ++k) varying += table.varies(k) ? 1 : 0;
  const bool is_certain = field.is_clock || varying == 1;
  std::vector<WrittenNumber> numbers;
  try {
    numbers = with_decimals(field.numbers);
  } catch (const std::invalid_argument&) {
    if (is_certain) throw;
    return std::nullopt;
  }
  Stamps stamps = stamps_of(numbers);
  if (stamps.ns.empty() && stamps.doubt.empty()) return std::nullopt;
  NameTimes times{.stamps_ns = std::move(stamps.ns), .keys = {}, .doubt = std::move(stamps.doubt)};
  times.keys = times.stamps_ns.empty() ? sort_keys_of(numbers) : times.stamps_ns;
  if (times.keys.empty()) return std::nullopt;
  if (field.is_combined &&
      (times.stamps_ns.empty() || !is_fraction(times.stamps_ns, counted(table.column(field.end - 1)))))
    return std::nullopt;
  if (!field.is_clock) require_no_sign(table, field, names);
  const auto wrong = contradiction(table, field, times.keys);
  if (!wrong) return times;
  if (!is_certain) return std::nullopt;
  throw std::invalid_argument(fmt::format(
      "{} is later than {} by the stamps in their names, but earlier by the numbers; correct what is wrong",
      names[wrong->second], names[wrong->first]));
}

/// Times of names that are texts with decimal numbers.
NameTimes times_in_decimals(const std::vector<std::string>& names) {
  const NameTable table(names);
  NameTimes doubtful;
  for (const auto& field_at :
       {+[](const NameTable&all, std::size_t k) { return date_at(all, k); },
        +[](const NameTable&all, std::size_t k) { return std::optional(number_at(all, k)); }}) {
    for (std::size_t k = 0; k < table.columns(); ++k) {
      const auto field = field_at(table, k);
      if (!field) continue;
      const bool varies = table.varies(k) || table.varies(field->end - 1);
      auto times = varies ? times_of(table, *field, names) : std::nullopt;
      if (times && !times->stamps_ns.empty()) return *times;
      if (times && doubtful.keys.empty()) doubtful = std::move(*times);
    }
  }
  return doubtful;
}

/// The number of characters that all names begin with.
std::size_t common_beginning(const std::vector<std::string>& names) {
  std::size_t common = names.front().size();
  for (const auto& name : names) {
    const auto differ = std::mismatch(name.begin(), name.end(), names.front().begin(), names.front().end());
    common = std::min(common, static_cast<std::size_t>(differ.first - name.begin()));
  }
  return common;
}

/// The names with their hexadecimal numbers, of one length, in decimal digits; empty if these are none.
std::vector<std::string> from_hexadecimal(const std::vector<std::string>& names) {
  constexpr std::size_t kLeast = 4;
  constexpr std::size_t kMost = 16;
  constexpr std::string_view kLetters = "abcdefABCDEF";
  constexpr int kBase = 16;
  const std::size_t common = common_beginning(names);
  const auto mark =
      std::string_view(names.front()).substr(0, common).find_last_not_of("0123456789abcdefABCDEF");
  const std::size_t begin = mark == std::string_view::npos ? 0 : mark + 1;
  const std::size_t length = names.front().size() - begin;
  bool has_letter = false;
  std::size_t with_digit = 0;
  for (const auto& name : names) {
    const auto digits = std::string_view(name).substr(begin);
    const bool hexadecimal = digits.find_first_not_of("0123456789abcdefABCDEF") == std::string_view::npos;
    if (!hexadecimal || digits.size() != length || length < kLeast) return {};
    has_letter = has_letter || name.find_first_of(kLetters, common) != std::string::npos;
    with_digit += digits.find_first_of(kDecimalDigits) != std::string_view::npos ? 1 : 0;
  }
  if (!has_letter || 2 * with_digit <= names.size()) return {};
  std::vector<std::string> decimal;
  for (const auto& name : names) {
    std::uint64_t value = 0;
    const auto error = std::from_chars(name.data() + begin, name.data() + name.size(), value, kBase).ec;
    if (length > kMost || error != std::errc{}) {
      throw std::invalid_argument(fmt::format(
          "{} is a hexadecimal number of {} digits, which gives no order of images; rename the images", name,
          length));
    }
    decimal.push_back(name.substr(0, begin) + std::to_string(value));
  }
  return decimal;
}

}  // namespace

NameTimes times_in(const std::vector<std::string>& names) {
  if (names.empty()) return {};
  const auto decimal = from_hexadecimal(names);
  if (decimal.empty()) return times_in_decimals(names);
  NameTimes times = times_in_decimals(decimal);
  constexpr std::int64_t kFrom1990_ns = 631'152'000'000'000'000;
  const auto& stamps_ns = times.stamps_ns;
  if (!stamps_ns.empty() && *std::ranges::min_element(stamps_ns) >= kFrom1990_ns) return times;
  times = {};
  const NameTable table(decimal);
  times.keys = table.columns() == 0 ? times.keys : counted(table.column(table.columns() - 1));
  if (!times.keys.empty()) return times;
  throw std::invalid_argument(
      fmt::format("{} is a hexadecimal number that neither counts images nor is a time; rename the images",
                  names.front()));
}

}  // namespace stereo_slam
