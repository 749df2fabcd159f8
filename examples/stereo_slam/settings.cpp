// SPDX-License-Identifier: MIT
// The one table of all settings, and the presets. A new setting takes one line here and a member in
// settings.hpp.
#include "settings.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>

#include "settings_io.hpp"
#include "settings_table.hpp"

namespace stereo_slam {
namespace {

std::vector<SettingsField> make_table() {
  std::vector<SettingsField> table;

  SettingsGroup(table, "").add("seed", &Settings::seed, {0, std::numeric_limits<std::uint64_t>::max()}, "",
                               "of every random draw");

  SettingsGroup(table, "features", &Settings::features)
      .add("count", &FeatureSettings::count, {50, 20000}, "", "ORB features an image")
      .add("levels", &FeatureSettings::levels, {1, 12}, "", "pyramid levels")
      .add("scale_factor", &FeatureSettings::scale_factor, {1.01, 2.0}, "", "between pyramid levels")
      .add("cell_px", &FeatureSettings::cell_px, {8, 512}, "px", "grid cell over which features are spread")
      .add("fast_threshold", &FeatureSettings::fast_threshold, {1, 255}, "grey levels",
           "of the corner detector")
      .add("min_fast_threshold", &FeatureSettings::min_fast_threshold, {1, 255}, "grey levels",
           "in cells that stay empty");

  SettingsGroup(table, "odometry", &Settings::odometry)
      .add("max_points", &OdometrySettings::max_points, {10, 10000}, "",
           "points followed from frame to frame")
      .add("cell_px", &OdometrySettings::cell_px, {8, 512}, "px", "bucket over which the points are spread")
      .add("window_px", &OdometrySettings::window_px, {5, 63}, "px", "side of the flow window")
      .add("pyramid_levels", &OdometrySettings::pyramid_levels, {0, 8}, "", "of the flow")
      .add("max_loop_error_px", &OdometrySettings::max_loop_error_px, {0.05, 20.0}, "px",
           "circular matching: distance between start and end of the circle")
      .add("max_row_error_px", &OdometrySettings::max_row_error_px, {0.05, 20.0}, "px", "epipolar check")
      .add("ransac_iterations", &OdometrySettings::ransac_iterations, {1, 100000}, "",
           "three-point hypotheses")
      .add("inlier_px", &OdometrySettings::inlier_px, {0.1, 20.0}, "px", "reprojection error of an inlier")
      .add("min_inliers", &OdometrySettings::min_inliers, {3, 10000}, "", "fewer make the motion unreliable")
      .add("pixel_sigma_px", &OdometrySettings::pixel_sigma_px, {0.01, 10.0}, "px",
           "standard deviation of a tracked coordinate");

  return table;
}

/// What measures best.
void apply_default(Settings&) {}

/// The DQV-SLAM paper's choices, section IV.
void apply_paper(Settings&) {}

}  // namespace

const std::vector<SettingsField>& settings_fields() {
  static const std::vector<SettingsField> table = make_table();
  return table;
}

const std::vector<Preset>& presets() {
  static const std::vector<Preset> list = {
      {"default", "what measures best", apply_default},
      {"paper", "the DQV-SLAM paper's algorithm as published", apply_paper},
  };
  return list;
}

}  // namespace stereo_slam
