// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "stereo_slam/settings/settings.hpp"

namespace stereo_slam {

/// One number, switch or choice that a user can set. Its default is `get(Settings{})`.
struct SettingsField {
  std::string key;      ///< dotted path, "features.count"
  std::string allowed;  ///< "a whole number from 50 to 20000", "one of: a, b"
  std::string unit;     ///< empty when it has none
  std::string doc;      ///< the meaning, as a phrase
  /// Sets the field from text. Returns false and changes nothing when the text is not of the allowed kind.
  std::function<bool(Settings&, const std::string&)> set;
  /// The field's value, in the notation that `set` reads.
  std::function<std::string(const Settings&)> get;
};

/// Every field that a user can set, in the order of the YAML file.
[[nodiscard]] const std::vector<SettingsField>& settings_fields();

/// A key of an earlier version and its present name.
struct RenamedKey {
  std::string_view old_key;
  std::string_view key;
};

[[nodiscard]] std::span<const RenamedKey> renamed_keys();

/// A key of an earlier version that is no setting any more.
struct RemovedKey {
  std::string key;
  std::string_view reason;  ///< and what to use instead
};

[[nodiscard]] const std::vector<RemovedKey>& removed_keys();

}  // namespace stereo_slam
