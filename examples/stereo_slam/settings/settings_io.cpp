// SPDX-License-Identifier: MIT
#include "stereo_slam/settings/settings_io.hpp"

#include <algorithm>
#include <array>
#include <fstream>
#include <numeric>
#include <set>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>
#include <fmt/ostream.h>
#include <yaml-cpp/yaml.h>

#include "stereo_slam/io/text_file.hpp"

namespace stereo_slam {
namespace {

/// Insertions, deletions and substitutions that turn one word into the other (Levenshtein 1966).
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t substitution = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = std::exchange(row[j], std::min({row[j] + 1, row[j - 1] + 1, substitution}));
    }
  }
  return row[b.size()];
}

std::string_view last_part(std::string_view key) { return key.substr(key.rfind('.') + 1); }

/// "; did you mean x?" for the nearest candidate, or nothing when none is near. A right word in a wrong group
/// is near.
std::string suggestion(std::string_view word, const std::vector<std::string>& candidates) {
  std::string_view best;
  std::size_t best_distance = std::max<std::size_t>(2, word.size() / 3) + 1;
  for (const auto& candidate : candidates) {
    const auto distance =
        std::min(edit_distance(word, candidate), edit_distance(last_part(word), last_part(candidate)) + 1);
    if (distance < best_distance) {
      best_distance = distance;
      best = candidate;
    }
  }
  return best.empty() ? "" : fmt::format("; did you mean {}?", best);
}

/// Keys of the structs that hold fields: "features" for "features.count".
std::set<std::string> group_keys() {
  std::set<std::string> groups;
  for (const auto& field : settings_fields()) {
    for (auto dot = field.key.find('.'); dot != std::string::npos; dot = field.key.find('.', dot + 1)) {
      groups.insert(field.key.substr(0, dot));
    }
  }
  return groups;
}

std::vector<std::string> known_keys() {
  const auto groups = group_keys();
  std::vector<std::string> keys(groups.begin(), groups.end());
  keys.emplace_back("preset");
  for (const auto& field : settings_fields()) keys.push_back(field.key);
  return keys;
}

std::string as_text(const YAML::Node& node) {
  if (node.IsScalar()) return node.Scalar();
  return node.IsMap() ? "{...}" : node.IsSequence() ? "[...]" : "nothing";
}

std::string allowed_with_unit(const SettingsField& field) {
  return field.unit.empty() ? field.allowed : fmt::format("{} {}", field.allowed, field.unit);
}

/// Walks the maps of a settings file and sets what it finds.
class Overlay {
 public:
  Overlay(const std::filesystem::path& file, Settings& settings) : file_(file), settings_(settings) {}

  void apply(const YAML::Node& map, const std::string& prefix = "") {
    std::set<std::string> seen;
    for (const auto& entry : map) {
      if (!entry.first.IsScalar()) fail(entry.first, "a key must be a plain word");
      const std::string key = prefix + entry.first.Scalar();
      if (!seen.insert(key).second) fail(entry.first, fmt::format("{} is given twice", key));
      if (key == "preset") continue;
      if (groups_.contains(key)) {
        if (!entry.second.IsMap())
          fail(entry.first, fmt::format("{} is a group of settings, not a value", key));
        apply(entry.second, key + ".");
      } else {
        set(key, entry.first, entry.second);
      }
    }
  }

  [[noreturn]] void fail(const YAML::Node& where, const std::string& message) const {
    throw std::runtime_error(at_line(file_, where.Mark().line + 1, message));
  }

 private:
  void set(const std::string& key, const YAML::Node& name, const YAML::Node& value) {
    const auto& fields = settings_fields();
    const auto field =
        std::find_if(fields.begin(), fields.end(), [&](const auto& f) { return f.key == key; });
    if (field == fields.end())
      fail(name, fmt::format("unknown setting {}{}", key, suggestion(key, known_keys())));
    if (!value.IsScalar() || !field->set(settings_, value.Scalar())) {
      fail(name, fmt::format("{} is {}, but must be {}", key, as_text(value), allowed_with_unit(*field)));
    }
  }

  const std::filesystem::path& file_;
  Settings& settings_;
  const std::set<std::string> groups_ = group_keys();
};

YAML::Node load_yaml(const std::filesystem::path& file) {
  std::ifstream stream(file);
  if (!stream || std::filesystem::is_directory(file)) {
    throw std::runtime_error(fmt::format("{}: cannot be read; check the path of --config", file.string()));
  }
  try {
    return YAML::Load(stream);
  } catch (const YAML::Exception& error) {
    throw std::runtime_error(
        at_line(file, error.mark.line + 1, fmt::format("not valid YAML: {}", error.msg)));
  }
}

}  // namespace

std::vector<std::string> preset_names() {
  std::vector<std::string> names;
  for (const auto& preset : presets()) names.push_back(preset.name);
  return names;
}

Settings preset_settings(std::string_view name) {
  for (const auto& preset : presets()) {
    if (preset.name != name) continue;
    Settings settings;
    preset.apply(settings);
    settings.preset = preset.name;
    return settings;
  }
  throw std::runtime_error(
      fmt::format("preset is {}, but must be one of: {}", name, fmt::join(preset_names(), ", ")));
}

Settings load_settings(const std::filesystem::path& file, std::optional<std::string_view> preset) {
  const YAML::Node document = load_yaml(file);
  if (document.IsNull()) return preset_settings(preset.value_or("default"));
  if (!document.IsMap())
    throw std::runtime_error(at_line(file, 1, "settings are `key: value` lines, this is not one"));
  const YAML::Node nested = document["settings"];
  const YAML::Node root = nested && nested.IsMap() ? nested : document;

  if (nested && nested.IsMap()) {  // a run.yaml: what else it holds is not read
    constexpr std::array<std::string_view, 10> kRunKeys = {
        "version", "written",    "state",  "error",   "frames_processed",
        "seconds", "pose_frame", "memory", "dataset", "host"};
    for (const auto& entry : document) {
      const auto key = as_text(entry.first);
      if (key != "settings" && std::find(kRunKeys.begin(), kRunKeys.end(), key) == kRunKeys.end()) {
        throw std::runtime_error(at_line(file, entry.first.Mark().line + 1,
                                         fmt::format("'{}' stands beside settings: and not in it", key)));
      }
    }
  }

  Settings settings;
  const YAML::Node named = root["preset"];
  try {
    settings = preset_settings(preset ? std::string(*preset) : named ? as_text(named) : "default");
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(at_line(file, named ? named.Mark().line + 1 : 1, error.what()));
  }
  Overlay(file, settings).apply(root);
  return settings;
}

void write_settings(std::ostream& stream, const Settings& settings, int indent) {
  const auto print = [&](std::size_t depth, const std::string& text, const std::string& comment) {
    const auto width = static_cast<std::size_t>(indent) + 2 * depth;
    fmt::print(stream, "{:{}}{:<{}}  # {}\n", "", width, text, width < 36 ? 36 - width : 0, comment);
  };
  fmt::print(stream, "{:{}}preset: {}\n", "", indent, settings.preset);
  std::string open_groups;
  for (const auto& field : settings_fields()) {
    const auto last_dot = field.key.rfind('.');
    const std::string groups = last_dot == std::string::npos ? "" : field.key.substr(0, last_dot + 1);
    std::size_t depth = 0;
    for (std::size_t begin = 0; begin < groups.size(); ++depth) {
      const auto end = groups.find('.', begin) + 1;
      if (open_groups.compare(0, end, groups, 0, end) != 0) {
        fmt::print(stream, "{:{}}{}:\n", "", static_cast<std::size_t>(indent) + 2 * depth,
                   groups.substr(begin, end - begin - 1));
        open_groups = groups.substr(0, end);
      }
      begin = end;
    }
    open_groups = groups;
    print(depth, fmt::format("{}: {}", field.key.substr(groups.size()), field.get(settings)),
          fmt::format("{}; {}", field.doc, allowed_with_unit(field)));
  }
}

}  // namespace stereo_slam
