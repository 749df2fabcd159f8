// SPDX-License-Identifier: MIT
#include "stereo_slam/io/pose_columns.hpp"

#include <algorithm>
#include <cctype>
#include <initializer_list>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace stereo_slam {
namespace {

using Words = std::vector<std::string>;

/// A column's meaning, and the rank of the name: the lowest is taken.
struct Meaning {
  std::string_view role;
  int rank = 0;
};

[[nodiscard]] bool is_any_of(std::string_view word, std::initializer_list<std::string_view> words) {
  return std::ranges::find(words, word) != words.end();
}

/// The words of a name, in lower case: "p_RS_R_x [m]" has p, rs, r, x; "positionX" has position, x.
[[nodiscard]] Words words_of(std::string_view name) {
  Words words(1);
  char before = ' ';
  for (const char c : name.substr(0, name.find_first_of("[("))) {
    const auto byte = static_cast<unsigned char>(c);
    const bool begins = std::isupper(byte) && std::islower(static_cast<unsigned char>(before));
    if ((begins || !std::isalnum(byte)) && !words.back().empty()) words.emplace_back();
    if (std::isalnum(byte)) words.back().push_back(static_cast<char>(std::tolower(byte)));
    before = c;
  }
  if (words.back().empty()) words.pop_back();
  return words;
}

[[nodiscard]] std::optional<StampUnit> unit_called(std::string_view word) {
  if (is_any_of(word, {"s", "sec", "secs", "second", "seconds"})) return StampUnit::kSeconds;
  if (is_any_of(word, {"ms", "msec", "msecs", "millisecond", "milliseconds"}))
    return StampUnit::kMilliseconds;
  if (is_any_of(word, {"us", "usec", "usecs", "microsecond", "microseconds"}))
    return StampUnit::kMicroseconds;
  if (is_any_of(word, {"ns", "nsec", "nsecs", "nanosec", "nanosecs", "nanosecond", "nanoseconds"}))
    return StampUnit::kNanoseconds;
  return std::nullopt;
}

/// The unit at the end of a name: "timestamp [ns]", "time(s)", "t_ns".
[[nodiscard]] std::optional<StampUnit> unit_in(std::string_view name) {
  const auto bracket = name.find_first_of("[(");
  const Words words = words_of(bracket == std::string_view::npos ? name : name.substr(bracket + 1));
  return words.empty() ? std::nullopt : unit_called(words.back());
}

[[nodiscard]] bool is_position_word(std::string_view word) {
  return is_any_of(word, {"p", "pos", "position", "t", "trans", "translation", "loc", "location"});
}

[[nodiscard]] bool is_rotation_word(std::string_view word) {
  return is_any_of(word,
                   {"q", "quat", "quaternion", "rot", "rotation", "ori", "orientation", "att", "attitude"});
}

/// Words of columns with axes that are no pose.
[[nodiscard]] bool is_other_word(std::string_view word) {
  return is_any_of(word,
                   {"v",   "vel",   "velocity", "twist",        "linear", "angular", "w",  "omega", "gyro",
                    "a",   "acc",   "accel",    "acceleration", "b",      "bg",      "ba", "bias",  "euler",
                    "rpy", "force", "torque",   "wrench",       "scale",  "error",   "err"});
}

[[nodiscard]] bool is_spread_word(std::string_view word) {
  return is_any_of(word, {"std", "stddev", "sigma", "var", "variance", "cov", "covariance"});
}

[[nodiscard]] std::string_view role_of(bool rotation, char axis) {
  switch (axis) {
    case 'x':
      return rotation ? "qx" : "x";
    case 'y':
      return rotation ? "qy" : "y";
    case 'z':
      return rotation ? "qz" : "z";
    default:
      return rotation ? "qw" : "";
  }
}

/// The axis that a name ends with, with the words before it: "px" is p, x. A zero byte if there is none.
[[nodiscard]] char take_axis(Words& words) {
  const std::string last = words.back();
  const char axis = last.back();
  if (!is_any_of(std::string_view(&axis, 1), {"w", "x", "y", "z"})) return '\0';
  const std::string before = last.substr(0, last.size() - 1);
  if (!before.empty() && !is_position_word(before) && !is_rotation_word(before)) return '\0';
  words.pop_back();
  if (!before.empty()) words.push_back(before);
  return axis;
}

[[nodiscard]] std::optional<Meaning> axis_meaning(Words words) {
  const char axis = take_axis(words);
  if (axis == '\0' || std::ranges::any_of(words, is_spread_word)) return std::nullopt;
  const auto telling = std::ranges::find_if(words, [](const std::string& word) {
    return is_position_word(word) || is_rotation_word(word) || is_other_word(word);
  });
  if (telling != words.end() && is_other_word(*telling)) return std::nullopt;
  const bool rotation = telling != words.end() && is_rotation_word(*telling);
  const std::string_view role = role_of(rotation, axis);
  if (role.empty()) return std::nullopt;
  const bool certain = words.empty() || telling != words.end();
  return Meaning{role, certain ? 0 : 1};
}

[[nodiscard]] std::optional<Meaning> stamp_meaning(const Words& words) {
  const auto has = [&](std::string_view word) { return std::ranges::find(words, word) != words.end(); };
  const bool of_nanoseconds =
      is_any_of(words.back(), {"nsec", "nsecs", "nanosec", "nanosecs", "nanoseconds"});
  if (has("header") && (has("stamp") || unit_called(words.back())))
    return Meaning{of_nanoseconds ? "nanoseconds" : "stamp", 0};
  if (of_nanoseconds && (words.size() == 1 || has("stamp")))
    return Meaning{"nanoseconds", words.size() == 1 ? 2 : 1};
  if (has("stamp") || has("timestamp") || has("timestamps")) return Meaning{"stamp", 1};
  Words rest = words;
  if (rest.size() > 1 && unit_called(rest.back())) rest.pop_back();
  if (rest.size() == 1 && (is_any_of(rest[0], {"time", "t", "ts"}) || unit_called(rest[0])))
    return Meaning{"stamp", 2};
  return std::nullopt;
}

[[nodiscard]] std::optional<Meaning> meaning_of(std::string_view name) {
  const Words words = words_of(name);
  if (words.empty()) return std::nullopt;
  if (const auto stamp = stamp_meaning(words)) return stamp;
  return axis_meaning(words);
}

}  // namespace

std::size_t PoseColumns::count() const {
  const std::size_t last = std::max({stamp, nanoseconds.value_or(0), *std::ranges::max_element(position),
                                     *std::ranges::max_element(quaternion)});
  return last + 1;
}

NamedColumns find_pose_columns(std::span<const std::string_view> names) {
  std::map<std::string_view, std::pair<std::size_t, int>> found;  // column and rank of each role
  NamedColumns named;
  std::map<std::string_view, std::array<std::string_view, 2>> twice;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto meaning = meaning_of(names[i]);
    if (!meaning) continue;
    const auto [entry, is_new] = found.try_emplace(meaning->role, i, meaning->rank);
    auto& [column, rank] = entry->second;
    if (!is_new && meaning->rank == rank)
      twice.try_emplace(meaning->role, std::array{names[column], names[i]});
    if (is_new || meaning->rank >= rank) continue;
    entry->second = {i, meaning->rank};
    twice.erase(meaning->role);
  }
  named.position = found.contains("x") && found.contains("y") && found.contains("z");
  for (const std::string_view role : {"stamp", "x", "y", "z", "qw", "qx", "qy", "qz"}) {
    if (named.missing.empty() && !found.contains(role)) named.missing = role;
  }
  if (!twice.empty()) named.twice = twice.begin()->second;
  if (!named.missing.empty() || !twice.empty()) return named;
  const auto column = [&](std::string_view role) { return found.at(role).first; };
  named.columns = PoseColumns{.stamp = column("stamp"),
                              .nanoseconds = std::nullopt,
                              .unit = unit_in(names[column("stamp")]),
                              .position = {column("x"), column("y"), column("z")},
                              .quaternion = {column("qw"), column("qx"), column("qy"), column("qz")}};
  const auto part = found.find("nanoseconds");
  const bool parts = part != found.end() && part->second.second == found.at("stamp").second &&
                     named.columns->unit == StampUnit::kSeconds;
  if (parts) named.columns->nanoseconds = part->second.first;
  return named;
}

}  // namespace stereo_slam
