// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

#include <yaml-cpp/yaml.h>

namespace stereo_slam {

/// Largest size of a YAML file that is read.
constexpr std::size_t kMostYamlBytes = std::size_t{1} << 20;

/// Reads a YAML file of one document; an empty document is null. Throws std::runtime_error, with file and
/// line, when the file cannot be read, is larger than kMostYamlBytes or not valid, holds several documents,
/// gives a key twice, has a key that is empty or ends with a point, contains an alias (`*a`) or a byte that
/// is zero, or is nested more than 16 levels deep.
[[nodiscard]] YAML::Node load_yaml_file(const std::filesystem::path& file);

/// The documents of a YAML file, which lines `---` separate; at least one. Throws like load_yaml_file().
[[nodiscard]] std::vector<YAML::Node> load_yaml_documents(const std::filesystem::path& file);

/// What to say of a key that is a number, since a decimal comma ends a value in {}: {fx: 707,09}. Empty for
/// other keys.
[[nodiscard]] std::string_view decimals_advice(std::string_view key);

}  // namespace stereo_slam
