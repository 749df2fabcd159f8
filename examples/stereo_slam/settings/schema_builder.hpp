// SPDX-License-Identifier: MIT
#pragma once

#include <charconv>
#include <concepts>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "stereo_slam/settings/schema.hpp"

/// Builds the table of settings. One description of a field determines how it is read, checked and printed.
namespace stereo_slam {

/// Closed interval of allowed values.
template <class T>
struct Range {
  T min, max;
};

/// Names of the values of an enumeration.
template <class Enum>
using Choices = std::vector<std::pair<std::string, Enum>>;

namespace detail {

template <class T>
std::optional<T> parse_setting(const std::string& text) {
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// Follows pointers to members from the root.
template <class Object, class Member, class... Members>
auto& follow(Object& object, Member member, Members... members) {
  if constexpr (sizeof...(members) == 0) {
    return object.*member;
  } else {
    return follow(object.*member, members...);
  }
}

}  // namespace detail

/// Collects the fields of one nested struct of Settings under one key: `SettingsGroup(table,
/// "features", &Settings::features)`. For a struct nested deeper, the key has dots and the path several
/// members.
template <class... Path>
class SettingsGroup {
 public:
  SettingsGroup(std::vector<SettingsField>& table, const std::string& key, Path... path)
      : table_(table), prefix_(key.empty() ? "" : key + "."), path_(path...) {}

  /// A number from range.min to range.max (integers of any size, or double).
  template <class Struct, class T>
  requires(std::is_arithmetic_v<T> &&
           !std::same_as<T, bool>) SettingsGroup& add(std::string_view name, T Struct::*member,
                                                      Range<std::type_identity_t<T>> range,
                                                      std::string_view unit, std::string_view doc) {
    const auto kind = std::integral<T> ? "a whole number" : "a number";
    return append({.key = prefix_ + std::string(name),
                   .allowed = fmt::format("{} from {} to {}", kind, range.min, range.max),
                   .unit = std::string(unit),
                   .doc = std::string(doc),
                   .set =
                       [at = accessor(member), range](Settings& settings, const std::string& text) {
                         const auto value = detail::parse_setting<T>(text);
                         if (!value || !(*value >= range.min && *value <= range.max)) return false;
                         at(settings) = *value;
                         return true;
                       },
                   .get = [at = accessor(member)](
                              const Settings& settings) { return fmt::format("{}", at(settings)); }});
  }

  /// A switch.
  template <class Struct>
  SettingsGroup& add(std::string_view name, bool Struct::*member, std::string_view doc) {
    return add(name, member, Choices<bool>{{"true", true}, {"false", false}}, doc);
  }

  /// One of several names.
  template <class Struct, class T>
  SettingsGroup& add(std::string_view name, T Struct::*member, Choices<std::type_identity_t<T>> choices,
                     std::string_view doc) {
    std::vector<std::string> names;
    for (const auto& [choice, value] : choices) names.push_back(choice);
    return append({.key = prefix_ + std::string(name),
                   .allowed = fmt::format("one of: {}", fmt::join(names, ", ")),
                   .unit = "",
                   .doc = std::string(doc),
                   .set =
                       [at = accessor(member), choices](Settings& settings, const std::string& text) {
                         for (const auto& [choice, value] : choices) {
                           if (choice != text) continue;
                           at(settings) = value;
                           return true;
                         }
                         return false;
                       },
                   .get = [at = accessor(member), choices](const Settings& settings) -> std::string {
                     for (const auto& [choice, value] : choices) {
                       if (at(settings) == value) return choice;
                     }
                     return "";
                   }});
  }

 private:
  template <class Member>
  auto accessor(Member member) const {
    return [path = std::tuple_cat(path_, std::make_tuple(member))](auto& settings) -> auto& {
      return std::apply(
          [&](auto... members) -> auto& { return detail::follow(settings, members...); }, path);
    };
  }

  SettingsGroup& append(SettingsField field) {
    table_.push_back(std::move(field));
    return *this;
  }

  std::vector<SettingsField>& table_;
  std::string prefix_;
  std::tuple<Path...> path_;
};

}  // namespace stereo_slam
