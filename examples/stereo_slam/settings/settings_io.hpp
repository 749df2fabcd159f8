// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <optional>
#include <ostream>
#include <string>
#include <string_view>

#include "stereo_slam/settings/settings.hpp"

namespace stereo_slam {

/// Reads settings from YAML: those of the preset (`preset` if given, else the file's `preset:`, else
/// default), overlaid with the file's values. The run.yaml of a run is accepted, too; its `settings:` are
/// read. Throws std::runtime_error with one line that names file, line, key and value, and says what is
/// allowed.
[[nodiscard]] Settings load_settings(const std::filesystem::path& file,
                                     std::optional<std::string_view> preset = std::nullopt);

/// Sets one value from text, by its key ("features.count"). Throws std::runtime_error that names key and
/// value, and says what is allowed.
void set_setting(Settings& settings, const std::string& key, const std::string& value);

/// Writes all settings as YAML that load_settings reads. A comment at each setting gives its meaning and
/// range, and its default if the value differs from it. Every line starts with `indent` spaces.
void write_settings(std::ostream& stream, const Settings& settings, int indent = 0);

}  // namespace stereo_slam
