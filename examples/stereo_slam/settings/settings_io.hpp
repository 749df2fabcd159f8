// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <optional>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

#include "stereo_slam/settings/settings.hpp"
#include "stereo_slam/settings/settings_table.hpp"

namespace stereo_slam {

/// Every field a user can set, in the order of the YAML file.
[[nodiscard]] const std::vector<SettingsField>& settings_fields();

/// A named set of values to start from.
struct Preset {
  std::string name;
  std::string doc;
  void (*apply)(Settings&);  ///< changes what differs from the defaults
};

[[nodiscard]] const std::vector<Preset>& presets();
[[nodiscard]] std::vector<std::string> preset_names();

/// The settings of a preset; throws std::runtime_error naming the ones there are.
[[nodiscard]] Settings preset_settings(std::string_view name);

/// Reads YAML: the preset (`preset` if given, else the file's `preset:` key, else default) overlaid with the
/// file's values. The run.yaml of an earlier run is read too: its `settings:` are taken. Throws
/// std::runtime_error with one line naming file, line, key, value and what is allowed.
[[nodiscard]] Settings load_settings(const std::filesystem::path& file,
                                     std::optional<std::string_view> preset = std::nullopt);

/// Writes all settings as YAML that load_settings reads, each with its unit, range and meaning as a comment;
/// every line starts with `indent` spaces.
void write_settings(std::ostream& stream, const Settings& settings, int indent = 0);

}  // namespace stereo_slam
