// SPDX-License-Identifier: MIT
#include "stereo_slam/settings/presets.hpp"

#include <array>
#include <stdexcept>

#include <fmt/format.h>

#include "stereo_slam/core/pixel_noise.hpp"

namespace stereo_slam {
namespace {

/// The DQV-SLAM paper's choices, section IV: detected corners as measurements, one global map with landmarks
/// updated in every frame, 7 x 7 pose samples, no correlation, subsets of 30. The paper does not give tau.
void apply_paper(Settings& settings) {
  settings.system = SystemKind::kPaper;
  settings.calibration = {.principal_point_sigma_px = 0.0,
                          .common_error_px = 0.0,
                          .scale_sigma_per_px = 0.0,
                          .principal_point_per_px = 0.0};
  settings.online_rectification.enabled = false;
  settings.odometry.window_px = 15;
  settings.odometry.pyramid_levels = 3;
  settings.update.tau = 0.05;
  settings.update.student_t_inverse_dof = 0.0;
  settings.update.noise_from_residuals = false;
  settings.map.clear_correlation = -1.0;
  settings.map.pixel_sigma_px = settings.association.feature_sigma_px;
  settings.loop_closure.enabled = false;
}

void apply_odometry(Settings& settings) {
  settings.system = SystemKind::kOdometry;
  settings.loop_closure.enabled = false;
}

/// Nearly as accurate as the default in 60 % of its time: fewer points, spread over larger cells, fewer
/// keyframes, and a pose update without samples.
void apply_fast(Settings& settings) {
  settings.odometry.max_points = 120;
  settings.odometry.cell_px = 80;
  settings.map.max_new_landmarks = 200;
  settings.map.cell_px = 60;
  settings.map.clear_correlation = -1.0;
  settings.keyframes.min_match_ratio = 0.45;
  settings.keyframes.min_matches = 35;
  settings.update.method = PoseUpdateMethod::kLeastSquares;
  settings.calibration.common_error_px = kCommonErrorFast_px;
}

struct Preset {
  std::string_view name;
  void (*apply)(Settings&);  ///< changes what differs from the defaults
};

constexpr std::array<Preset, 4> kPresets = {{{"default", [](Settings&) {}},
                                             {"fast", apply_fast},
                                             {"paper", apply_paper},
                                             {"odometry", apply_odometry}}};

}  // namespace

std::vector<std::string> preset_names() {
  std::vector<std::string> names;
  names.reserve(kPresets.size());
  for (const auto& preset : kPresets) names.emplace_back(preset.name);
  return names;
}

Settings preset_settings(std::string_view name) {
  for (const auto& preset : kPresets) {
    if (preset.name != name) continue;
    Settings settings;
    preset.apply(settings);
    settings.preset = preset.name;
    return settings;
  }
  throw std::runtime_error(
      fmt::format("preset is {}, but must be one of: {}", name, fmt::join(preset_names(), ", ")));
}

}  // namespace stereo_slam
