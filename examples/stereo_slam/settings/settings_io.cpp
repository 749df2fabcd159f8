// SPDX-License-Identifier: MIT
#include "stereo_slam/settings/settings_io.hpp"

#include <algorithm>
#include <array>
#include <numeric>
#include <set>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>
#include <fmt/ostream.h>
#include <yaml-cpp/yaml.h>

#include "stereo_slam/io/text_file.hpp"
#include "stereo_slam/settings/presets.hpp"
#include "stereo_slam/settings/schema.hpp"
#include "stereo_slam/settings/yaml_file.hpp"

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

/// "; did you mean x?" for the nearest candidate by edit distance, or nothing when none is near. A known word
/// in the wrong group counts as near.
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

/// Inserts the groups that a key is in: "features" for "features.count".
void insert_groups(std::string_view key, std::set<std::string>& groups) {
  for (auto dot = key.find('.'); dot != std::string_view::npos; dot = key.find('.', dot + 1))
    groups.emplace(key.substr(0, dot));
}

std::set<std::string> group_keys() {
  std::set<std::string> groups;
  for (const auto& field : settings_fields()) insert_groups(field.key, groups);
  return groups;
}

/// The current groups and those of keys that were renamed or removed.
std::set<std::string> readable_groups() {
  std::set<std::string> groups = group_keys();
  for (const auto& renamed : renamed_keys()) insert_groups(renamed.old_key, groups);
  for (const auto& removed : removed_keys()) insert_groups(removed.key, groups);
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

/// What is said about a key that is no setting any more; nothing for others.
std::string reason_of_removal(const std::string& key) {
  for (const auto& removed : removed_keys()) {
    if (removed.key == key) return fmt::format("{} is no setting any more: {}", key, removed.reason);
  }
  return {};
}

/// Throws std::runtime_error for a key that no setting has.
const SettingsField& field_of(const std::string& key) {
  for (const auto& renamed : renamed_keys()) {
    if (renamed.old_key == key)
      throw std::runtime_error(fmt::format("{} is called {} now", key, renamed.key));
  }
  if (const auto reason = reason_of_removal(key); !reason.empty()) throw std::runtime_error(reason);
  const auto& fields = settings_fields();
  const auto field = std::ranges::find_if(fields, [&](const auto& f) { return f.key == key; });
  if (field == fields.end()) {
    const std::string_view word = last_part(key);
    const std::string_view advice = decimals_advice(word);
    throw std::runtime_error(fmt::format(
        "unknown setting {}{}", key, advice.empty() ? suggestion(key, known_keys()) : std::string(advice)));
  }
  return *field;
}

std::string refusal(const SettingsField& field, std::string_view value) {
  return fmt::format("{} is {}, but must be {}", field.key, value, allowed_with_unit(field));
}

/// Walks the maps of a settings file and sets the values it finds.
class Overlay {
 public:
  Overlay(const std::filesystem::path& file, Settings& settings) : file_(file), settings_(settings) {}

  void apply(const YAML::Node& root) {
    apply(root, "");
    if (gone_.empty()) return;
    const std::string others =
        gone_.size() > 1 ? fmt::format("; neither are {}", fmt::join(gone_.begin() + 1, gone_.end(), ", "))
                         : "";
    throw std::runtime_error(first_gone_ + others);
  }

  [[noreturn]] void fail(const YAML::Node& where, const std::string& message) const {
    fail_at(file_, where.Mark().line + 1, message);
  }

 private:
  void apply(const YAML::Node& map, const std::string& prefix) {
    for (const auto& entry : map) {
      if (!entry.first.IsScalar()) fail(entry.first, "a key must be a plain word");
      const std::string key = prefix + entry.first.Scalar();
      if (key == "preset") continue;
      if (groups_.contains(key)) {
        if (!entry.second.IsMap()) {
          fail(entry.first,
               group_keys().contains(key)
                   ? fmt::format("{} is a group of settings, not a value; write its settings below it", key)
                   : fmt::format("{} has no settings any more; leave it out", key));
        }
        apply(entry.second, key + ".");
      } else {
        set(key, entry.first, entry.second);
      }
    }
  }

  void set(const std::string& key, const YAML::Node& name, const YAML::Node& value) {
    const auto& removed = removed_keys();
    if (std::ranges::any_of(removed, [&](const auto& r) { return r.key == key; })) {
      if (gone_.empty()) first_gone_ = at_line(file_, name.Mark().line + 1, reason_of_removal(key));
      gone_.push_back(key);
      return;
    }
    const SettingsField* field = nullptr;
    try {
      field = &field_of(key);
    } catch (const std::runtime_error& error) {
      fail(name, error.what());
    }
    if (!given_.insert(key).second) fail(name, key + " is given twice");
    if (!value.IsScalar() || !field->set(settings_, value.Scalar()))
      fail(name, refusal(*field, as_text(value)));
  }

  const std::filesystem::path& file_;
  Settings& settings_;
  const std::set<std::string> groups_ = readable_groups();
  std::vector<std::string> gone_;  // keys so far that are no settings any more
  std::string first_gone_;         // the message about the first of them
  std::set<std::string> given_;    // keys so far: `images.clahe: true` and `images: {clahe: true}` are one
};

/// Throws if the file of a run holds anything beside `settings:` that write_run_yaml does not write.
void check_run_keys(const std::filesystem::path& file, const YAML::Node& document) {
  constexpr std::array<std::string_view, 18> kRunKeys = {
      "settings",         "version",           "written",    "state",      "error",
      "frames_processed", "seconds",           "pose_frame", "frame_cost", "realtime",
      "memory",           "unreadable_images", "dataset",    "host",       "weak_frames_by_reason",
      "lens_error",       "right_delay",       "imu"};
  for (const auto& entry : document) {
    const auto key = as_text(entry.first);
    if (std::ranges::find(kRunKeys, key) != kRunKeys.end()) continue;
    fail_at(file, entry.first.Mark().line + 1,
            "{} stands outside `settings:`; move it into the group `settings:`", key);
  }
}

/// The comment of a setting: meaning; range; the default, if the value is another one.
std::string explanation(const SettingsField& field, const Settings& settings) {
  const std::string standard = field.get(Settings{});
  return fmt::format("{}; {}{}", field.doc, allowed_with_unit(field),
                     field.get(settings) == standard ? "" : fmt::format("; default {}", standard));
}

}  // namespace

Settings load_settings(const std::filesystem::path& file, std::optional<std::string_view> preset) {
  const YAML::Node document = load_yaml_file(file);
  if (document.IsNull()) return preset_settings(preset.value_or("default"));
  if (!document.IsMap()) fail_at(file, 1, "not a settings file; write one `key: value` a line");
  const YAML::Node nested = document["settings"];
  const bool is_run_yaml = nested && nested.IsMap();
  if (is_run_yaml) check_run_keys(file, document);
  const YAML::Node root = is_run_yaml ? nested : document;

  Settings settings;
  const YAML::Node named = root["preset"];
  if (is_run_yaml && preset && named && as_text(named) != *preset) {
    fail_at(file, named.Mark().line + 1,
            "these are all settings of a run with the preset {}, not {}; use that preset, or a file that has "
            "only what you change",
            as_text(named), *preset);
  }
  try {
    settings = preset_settings(preset ? std::string(*preset) : named ? as_text(named) : "default");
  } catch (const std::runtime_error& error) {
    fail_at(file, named ? named.Mark().line + 1 : 1, error.what());
  }
  Overlay(file, settings).apply(root);
  return settings;
}

void set_setting(Settings& settings, const std::string& key, const std::string& value) {
  const SettingsField& field = field_of(key);
  if (!field.set(settings, value)) throw std::runtime_error(refusal(field, value));
}

void write_settings(std::ostream& stream, const Settings& settings, int indent) {
  const auto spaces = [&](std::size_t depth) { return static_cast<std::size_t>(indent) + 2 * depth; };
  fmt::print(stream, "{:{}}preset: {}\n", "", indent, settings.preset);
  std::string open_groups;
  for (const auto& field : settings_fields()) {
    const auto last_dot = field.key.rfind('.');
    const std::string groups = last_dot == std::string::npos ? "" : field.key.substr(0, last_dot + 1);
    std::size_t depth = 0;
    for (std::size_t begin = 0; begin < groups.size(); ++depth) {
      const auto end = groups.find('.', begin) + 1;
      if (open_groups.compare(0, end, groups, 0, end) != 0)
        fmt::print(stream, "{:{}}{}:\n", "", spaces(depth), groups.substr(begin, end - begin - 1));
      begin = end;
    }
    open_groups = groups;
    const std::size_t width = spaces(depth);
    fmt::print(stream, "{:{}}{:<{}}  # {}\n", "", width,
               fmt::format("{}: {}", field.key.substr(groups.size()), field.get(settings)),
               width < 36 ? 36 - width : 0, explanation(field, settings));
  }
}

}  // namespace stereo_slam
