// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "stereo_slam/settings/settings.hpp"

/// Presets: named sets of values to start from.
///   default   the best measured accuracy
///   fast      nearly as accurate in 60 % of the time of default
///   paper     the DQV-SLAM paper's algorithm as published
///   odometry  the stereo odometry alone, as a baseline
namespace stereo_slam {

[[nodiscard]] std::vector<std::string> preset_names();

/// The settings of a preset. Throws std::runtime_error, listing the presets, for an unknown name.
[[nodiscard]] Settings preset_settings(std::string_view name);

}  // namespace stereo_slam
