// SPDX-License-Identifier: MIT
// The table of all settings: key, member, range, unit and meaning. A new setting takes a member with its
// default in settings.hpp and an entry here.
#include "stereo_slam/settings/schema.hpp"

#include <array>
#include <cstdint>
#include <limits>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "stereo_slam/io/text_file.hpp"
#include "stereo_slam/settings/schema_builder.hpp"

namespace stereo_slam {
namespace {

using Table = std::vector<SettingsField>;

void add_general(Table& table) {
  SettingsGroup(table, "").add("seed", &Settings::seed, {0, std::numeric_limits<std::uint64_t>::max()}, "",
                               "seed of the random number generators");
}

void add_images(Table& table) {
  SettingsGroup(table, "images", &Settings::images)
      .add("clahe", &ImageSettings::clahe,
           "equalise the contrast locally (CLAHE); for dark or unevenly lit images");
}

void add_features(Table& table) {
  SettingsGroup(table, "features", &Settings::features)
      .add("count", &FeatureSettings::count, {50, 20000}, "",
           "number of ORB features per image; used in every frame with --preset paper, otherwise to "
           "recognise the last keyframe after a loss");
}

void add_stereo(Table& table) {
  SettingsGroup(table, "stereo", &Settings::stereo)
      .add("max_disparity_px", &StereoMatchingSettings::max_disparity_px, {8, 2000}, "px",
           "largest disparity searched along the row");
}

void add_calibration(Table& table) {
  SettingsGroup(table, "calibration", &Settings::calibration)
      .add("scale_sigma", &CalibrationSettings::scale_sigma, {0.0, 0.5}, "",
           "known relative standard deviation of the calibrated scale (baseline times focal length)")
      .add("principal_point_sigma_px", &CalibrationSettings::principal_point_sigma_px, {0.0, 50.0}, "px",
           "known standard deviation of the calibrated principal point")
      .add("common_error_px", &CalibrationSettings::common_error_px, {0.0, 50.0}, "px",
           "error that all motions between keyframes have in common: root mean square of its three angles")
      .add(
          "scale_sigma_per_px", &CalibrationSettings::scale_sigma_per_px, {0.0, 0.5}, "1/px",
          "relative standard deviation of the scale, per pixel of row offset that online_rectification finds")
      .add("principal_point_per_px", &CalibrationSettings::principal_point_per_px, {0.0, 50.0}, "",
           "standard deviation of the principal point in pixels, per pixel of row offset that "
           "online_rectification finds");
}

void add_online_rectification(Table& table) {
  SettingsGroup(table, "online_rectification", &Settings::online_rectification)
      .add("enabled", &OnlineRectificationSettings::enabled,
           "estimate the remaining errors of the rectification during the run; not with --preset paper")
      .add("row_sigma_px", &OnlineRectificationSettings::row_sigma_px, {0.001, 20.0}, "px",
           "prior standard deviation of the row offset at the image border")
      .add("disparity_sigma_px", &OnlineRectificationSettings::disparity_sigma_px, {0.001, 20.0}, "px",
           "largest prior standard deviation of the disparity offset at the image border; smaller if the row "
           "offsets show a good calibration");
}

void add_odometry(Table& table) {
  SettingsGroup(table, "odometry", &Settings::odometry)
      .add("max_points", &OdometrySettings::max_points, {10, 10000}, "",
           "largest number of points tracked from frame to frame")
      .add("pixel_sigma_px", &OdometrySettings::pixel_sigma_px, {0.01, 10.0}, "px",
           "standard deviation of a tracked coordinate, for the selection of inliers");
}

void add_motion(Table& table) {
  SettingsGroup(table, "motion", &Settings::motion)
      .add("lost_rotation_sigma_rad", &MotionSettings::lost_rotation_sigma_rad, {1e-6, 0.1}, "rad",
           "standard deviation of the predicted rotation, at most, of a frame without odometry, per axis")
      .add("lost_translation_sigma_m", &MotionSettings::lost_translation_sigma_m, {1e-6, 100.0}, "m",
           "standard deviation of the predicted translation, at most, of a frame without odometry, per axis");
}

void add_refinement(Table& table) {
  SettingsGroup(table, "refinement", &Settings::refinement)
      .add("pixel_sigma_px", &RefinementSettings::pixel_sigma_px, {0.01, 10.0}, "px",
           "standard deviation of an aligned coordinate, added to the noise estimated from its patch; not "
           "with --preset paper");
}

void add_update(Table& table) {
  SettingsGroup(table, "update", &Settings::update)
      .add("noise_from_residuals", &UpdateSettings::noise_from_residuals,
           "scale the covariances to the residuals of the landmarks in the last updates, along and across "
           "the rows; not with --preset paper");
}

void add_map(Table& table) {
  SettingsGroup(table, "map", &Settings::map)
      .add("max_new_landmarks", &MapSettings::max_new_landmarks, {10, 100000}, "",
           "largest number of new landmarks per keyframe, and per frame with --preset paper")
      .add("max_baselines", &MapSettings::max_baselines, {1.0, 1e6}, "baselines",
           "depth beyond which landmarks are not used")
      .add("pixel_sigma_px", &MapSettings::pixel_sigma_px, {0.01, 10.0}, "px",
           "standard deviation of a new landmark's coordinates, added to the noise estimated from its patch");
}

void add_keyframes(Table& table) {
  SettingsGroup(table, "keyframes", &Settings::keyframes)
      .add("min_match_ratio", &KeyframeSettings::min_match_ratio, {0.0, 1.0}, "",
           "a new keyframe is taken if a smaller fraction of the last keyframe's landmarks is matched; not "
           "with --preset paper")
      .add("max_frames", &KeyframeSettings::max_frames, {1, 100000}, "frames",
           "largest distance between successive keyframes; not with --preset paper");
}

void add_loop_closure(Table& table) {
  SettingsGroup(table, "loop_closure", &Settings::loop_closure)
      .add("enabled", &LoopClosureSettings::enabled, "close loops; not with --preset paper");
}

Table make_table() {
  Table table;
  for (const auto add :
       {add_general, add_images, add_features, add_stereo, add_calibration, add_online_rectification,
        add_odometry, add_motion, add_refinement, add_update, add_map, add_keyframes, add_loop_closure}) {
    add(table);
  }
  return table;
}

/// Groups, and settings that they had in earlier versions. Each preset has constants in their place.
constexpr std::pair<std::string_view, std::string_view> kFormerSettings[] = {
    {"images", "clahe_clip_limit clahe_tiles"},
    {"features", "levels scale_factor cell_px fast_threshold"},
    {"stereo", "min_disparity_px max_row_error_px uniqueness min_correlation"},
    {"odometry",
     "max_loop_error_px cell_px window_px pyramid_levels max_closure_error_px max_row_error_px "
     "ransac_iterations min_inliers exclusion_px"},
    {"motion", "covariance_scale min_rotation_sigma_rad min_translation_sigma_m"},
    {"association",
     "feature_sigma_px max_descriptor_distance descriptor_ratio max_row_error_px flow_window_px "
     "flow_tolerance_px flow_relative_tolerance"},
    {"refinement", "min_correlation max_shift_px max_row_error_px gate_sigma_px"},
    {"update",
     "tau max_correspondences regularizer_sigma_m regularizer_forgetting robust_cap student_t_inverse_dof "
     "min_matches"},
    {"map", "cell_px inverse_depth_beyond_baselines clear_correlation cull_after_frames"},
    {"keyframes", "min_matches"},
    {"loop_closure", "max_points latency_frames spacing_baselines"},
    {"place_recognition",
     "trees leaf_size max_descriptor_distance min_gap_frames candidates min_score view_radius_m "
     "min_share_in_view"},
    {"loop_verification",
     "max_descriptor_distance descriptor_ratio ransac_iterations max_reprojection_error_px "
     "search_radius_px pixel_sigma_px covariance_scale min_inliers consecutive relocalisation_inliers "
     "max_chi2 gate_scale drift_m_per_m drift_rad_per_m"},
    {"pose_graph", "max_iterations loop_scale"},
};

}  // namespace

const std::vector<SettingsField>& settings_fields() {
  static const Table table = make_table();
  return table;
}

const std::vector<RemovedKey>& removed_keys() {
  static const std::vector<RemovedKey> kRemoved = [] {
    std::vector<RemovedKey> removed{
        {"map.layout", "the preset decides: paper has one global map, the others have keyframes"},
        {"map.update_landmarks", "the preset paper updates its landmarks, the others do not"},
        {"map.track_correlation", "it is always kept, but by the preset paper"},
        {"refinement.enabled", "patches are always aligned, but with the preset paper"},
        {"update.method", "the presets paper and odometry have other methods than the default"}};
    for (const auto& [group, names] : kFormerSettings) {
      for (const auto name : split_fields(names))
        removed.push_back(
            {fmt::format("{}.{}", group, name), "its value is that of the preset; leave it out"});
    }
    return removed;
  }();
  return kRemoved;
}

std::span<const RenamedKey> renamed_keys() {
  static constexpr std::array<RenamedKey, 5> kRenamed = {
      {{"rectification.refine", "online_rectification.enabled"},
       {"rectification.row_sigma_px", "online_rectification.row_sigma_px"},
       {"rectification.disparity_sigma_px", "online_rectification.disparity_sigma_px"},
       {"rectification.scale_sigma", "calibration.scale_sigma"},
       {"rectification.principal_point_sigma_px", "calibration.principal_point_sigma_px"}}};
  return kRenamed;
}

}  // namespace stereo_slam
