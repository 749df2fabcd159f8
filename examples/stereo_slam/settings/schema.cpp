// SPDX-License-Identifier: MIT
// The table of all settings: key, member, range, unit and meaning. A new setting takes a member with its
// default in settings.hpp and an entry here.
#include "stereo_slam/settings/schema.hpp"

#include <array>
#include <cstdint>
#include <limits>

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
           "equalise the contrast locally (CLAHE); for dark or unevenly lit images")
      .add("clahe_clip_limit", &ImageSettings::clahe_clip_limit, {1.0, 100.0}, "",
           "limit of the contrast gain of CLAHE")
      .add("clahe_tiles", &ImageSettings::clahe_tiles, {1, 64}, "",
           "number of CLAHE tiles per side of the image");
}

void add_features(Table& table) {
  SettingsGroup(table, "features", &Settings::features)
      .add(
          "count", &FeatureSettings::count, {50, 20000}, "",
          "number of ORB features per image; used in every frame with --preset paper, otherwise to recognise "
          "the last keyframe after a loss")
      .add("levels", &FeatureSettings::levels, {1, 12}, "", "number of pyramid levels")
      .add("scale_factor", &FeatureSettings::scale_factor, {1.01, 2.0}, "",
           "scale factor between pyramid levels")
      .add("cell_px", &FeatureSettings::cell_px, {8, 512}, "px", "grid cell over which features are spread")
      .add("fast_threshold", &FeatureSettings::fast_threshold, {1, 255}, "grey levels",
           "threshold of the FAST detector; each grid cell keeps its strongest corners");
}

void add_stereo(Table& table) {
  SettingsGroup(table, "stereo", &Settings::stereo)
      .add("max_disparity_px", &StereoMatchingSettings::max_disparity_px, {8, 2000}, "px",
           "largest disparity searched along the row")
      .add("min_disparity_px", &StereoMatchingSettings::min_disparity_px, {0.0, 50.0}, "px",
           "smallest disparity of a match")
      .add("max_row_error_px", &StereoMatchingSettings::max_row_error_px, {0.05, 20.0}, "px",
           "largest row difference of a stereo match (epipolar check)")
      .add("uniqueness", &StereoMatchingSettings::uniqueness, {0.1, 1.0}, "",
           "largest ratio of best to second-best matching cost")
      .add("min_correlation", &StereoMatchingSettings::min_correlation, {-1.0, 1.0}, "",
           "smallest correlation of the aligned patches");
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
           "estimate the remaining errors of the rectification during the run")
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
      .add("cell_px", &OdometrySettings::cell_px, {8, 512}, "px", "grid cell over which points are spread")
      .add("window_px", &OdometrySettings::window_px, {5, 21}, "px", "side of the optical-flow window")
      .add("pyramid_levels", &OdometrySettings::pyramid_levels, {1, 4}, "",
           "number of pyramid levels of the optical flow")
      .add("max_closure_error_px", &OdometrySettings::max_closure_error_px, {0.05, 20.0}, "px",
           "largest distance between start and end of circular matching (--preset paper)")
      .add("max_row_error_px", &OdometrySettings::max_row_error_px, {0.05, 20.0}, "px",
           "largest row difference of left and right point (epipolar check)")
      .add("ransac_iterations", &OdometrySettings::ransac_iterations, {1, 100000}, "",
           "largest number of three-point hypotheses of RANSAC")
      .add("min_inliers", &OdometrySettings::min_inliers, {3, 10000}, "",
           "smallest number of inliers; with fewer the measured motion is not used")
      .add("pixel_sigma_px", &OdometrySettings::pixel_sigma_px, {0.01, 10.0}, "px",
           "standard deviation of a tracked coordinate, for the selection of inliers")
      .add("exclusion_px", &OdometrySettings::exclusion_px, {0.0, 100.0}, "px",
           "smallest distance between points of the odometry and landmarks of the filter, and between new "
           "corners");
}

void add_motion(Table& table) {
  SettingsGroup(table, "motion", &Settings::motion)
      .add("covariance_scale", &MotionSettings::covariance_scale, {0.01, 100.0}, "",
           "factor on the covariance of the odometry")
      .add("min_rotation_sigma_rad", &MotionSettings::min_rotation_sigma_rad, {1e-6, 0.1}, "rad",
           "standard deviation of the rotation noise added to the odometry, per axis and frame")
      .add("min_translation_sigma_m", &MotionSettings::min_translation_sigma_m, {1e-6, 10.0}, "m",
           "standard deviation of the translation noise added to the odometry, per axis and frame")
      .add("lost_rotation_sigma_rad", &MotionSettings::lost_rotation_sigma_rad, {1e-6, 0.1}, "rad",
           "standard deviation of the predicted rotation of a frame without odometry, per axis")
      .add("lost_translation_sigma_m", &MotionSettings::lost_translation_sigma_m, {1e-6, 100.0}, "m",
           "standard deviation of the predicted translation of a frame without odometry, per axis");
}

void add_association(Table& table) {
  SettingsGroup(table, "association", &Settings::association)
      .add("feature_sigma_px", &AssociationSettings::feature_sigma_px, {0.05, 10.0}, "px",
           "standard deviation of a detected corner")
      .add("max_descriptor_distance", &AssociationSettings::max_descriptor_distance, {1, 256}, "bits",
           "largest Hamming distance of a match, of 256 bits")
      .add("descriptor_ratio", &AssociationSettings::descriptor_ratio, {0.1, 1.0}, "",
           "largest ratio of best to second-best distance in the search region (--preset paper)")
      .add("max_row_error_px", &AssociationSettings::max_row_error_px, {0.05, 20.0}, "px",
           "largest row difference of a stereo match (epipolar check)")
      .add("flow_window_px", &AssociationSettings::flow_window_px, {5, 21}, "px",
           "side of the optical-flow window")
      .add("flow_tolerance_px", &AssociationSettings::flow_tolerance_px, {0.1, 100.0}, "px",
           "flow gate: largest difference between observed and predicted optical flow")
      .add("flow_relative_tolerance", &AssociationSettings::flow_relative_tolerance, {0.0, 10.0}, "",
           "flow gate: additional tolerance, as a fraction of the length of the flow");
}

void add_refinement(Table& table) {
  SettingsGroup(table, "refinement", &Settings::refinement)
      .add("min_correlation", &RefinementSettings::min_correlation, {-1.0, 1.0}, "",
           "smallest correlation of the aligned patches")
      .add("max_shift_px", &RefinementSettings::max_shift_px, {0.1, 20.0}, "px",
           "largest distance of the aligned position from its start")
      .add("max_row_error_px", &RefinementSettings::max_row_error_px, {0.05, 20.0}, "px",
           "largest row difference of left and right position (epipolar check)")
      .add("pixel_sigma_px", &RefinementSettings::pixel_sigma_px, {0.01, 10.0}, "px",
           "standard deviation of an aligned coordinate, added to the noise estimated from its patch")
      .add("gate_sigma_px", &RefinementSettings::gate_sigma_px, {0.01, 10.0}, "px",
           "standard deviation of an aligned coordinate, for the innovation gate");
}

void add_update(Table& table) {
  SettingsGroup(table, "update", &Settings::update)
      .add("tau", &UpdateSettings::tau, {0.001, 0.99}, "",
           "smallest likelihood ratio within a progression step (--preset paper)")
      .add("max_correspondences", &UpdateSettings::max_correspondences, {3, 100000}, "",
           "number of matches per subset (--preset paper)")
      .add("regularizer_sigma_m", &UpdateSettings::regularizer_sigma_m, {0.0, 1.0}, "m",
           "standard deviation of the translation noise added between subsets (--preset paper)")
      .add("regularizer_forgetting", &UpdateSettings::regularizer_forgetting, {0.0, 1e-3}, "",
           "relative increase of the orientation uncertainty between subsets (--preset paper)")
      .add("robust_cap", &UpdateSettings::robust_cap, {1.0, 1e6}, "",
           "squared Mahalanobis distance beyond which a match is removed after the first update")
      .add("student_t_inverse_dof", &UpdateSettings::student_t_inverse_dof, {0.0, 1.0}, "",
           "1 / degrees of freedom of the Student-t distribution of the errors of matches: the larger, the "
           "less weight have large residuals; 0: normal distribution, equal weights")
      .add("min_matches", &UpdateSettings::min_matches, {3, 100000}, "",
           "smallest number of matches; with fewer the pose is only predicted")
      .add(
          "noise_from_residuals", &UpdateSettings::noise_from_residuals,
          "scale the covariances to the residuals of the landmarks in the last updates, along and across the "
          "rows; not with --preset paper");
}

void add_map(Table& table) {
  SettingsGroup(table, "map", &Settings::map)
      .add("max_new_landmarks", &MapSettings::max_new_landmarks, {10, 100000}, "",
           "largest number of new landmarks per keyframe, and per frame with --preset paper")
      .add("cell_px", &MapSettings::cell_px, {8, 512}, "px", "grid cell over which new landmarks are spread")
      .add("inverse_depth_beyond_baselines", &MapSettings::inverse_depth_beyond_baselines, {0.0, 1e6},
           "baselines", "depth beyond which landmarks are stored in inverse depth")
      .add("max_baselines", &MapSettings::max_baselines, {1.0, 1e6}, "baselines",
           "depth beyond which landmarks are not used")
      .add("clear_correlation", &MapSettings::clear_correlation, {-1.0, 1.0}, "",
           "landmarks whose patches correlate less in the two images, or are near and on no common surface, "
           "are "
           "added only where there would be fewer than half of max_new_landmarks without them; -1: all are "
           "added")
      .add("pixel_sigma_px", &MapSettings::pixel_sigma_px, {0.01, 10.0}, "px",
           "standard deviation of a new landmark's coordinates, added to the noise estimated from its patch")
      .add("cull_after_frames", &MapSettings::cull_after_frames, {1, 100000}, "frames",
           "time after which a landmark that is not observed is dropped");
}

void add_keyframes(Table& table) {
  SettingsGroup(table, "keyframes", &Settings::keyframes)
      .add("min_match_ratio", &KeyframeSettings::min_match_ratio, {0.0, 1.0}, "",
           "a new keyframe is taken if a smaller fraction of the last keyframe's landmarks is matched")
      .add("min_matches", &KeyframeSettings::min_matches, {0, 100000}, "",
           "a new keyframe is taken if fewer landmarks are matched")
      .add("max_frames", &KeyframeSettings::max_frames, {1, 100000}, "frames",
           "largest distance between successive keyframes");
}

void add_loop_closure(Table& table) {
  SettingsGroup(table, "loop_closure", &Settings::loop_closure)
      .add("enabled", &LoopClosureSettings::enabled, "close loops; not with --preset paper")
      .add("max_points", &LoopClosureSettings::max_points, {50, 10000}, "",
           "largest number of points that a keyframe keeps for place recognition")
      .add("latency_frames", &LoopClosureSettings::latency_frames, {1, 1000}, "frames",
           "delay between a keyframe and the correction by its loop; one frame is added per 50 keyframes")
      .add("spacing_baselines", &LoopClosureSettings::spacing_baselines, {0.0, 1e6}, "baselines",
           "smallest path length between two loops of the same revisit");
}

void add_place_recognition(Table& table) {
  SettingsGroup(table, "place_recognition", &Settings::place_recognition)
      .add("trees", &PlaceRecognitionSettings::trees, {1, 16}, "",
           "number of binary trees; they keep the first and the second half of each descriptor in turn")
      .add("leaf_size", &PlaceRecognitionSettings::leaf_size, {4, 10000}, "",
           "number of descriptors at which a leaf is split")
      .add("max_descriptor_distance", &PlaceRecognitionSettings::max_descriptor_distance, {1, 256}, "bits",
           "largest Hamming distance between views of one point, of 256 bits; a tree compares 128 bits and "
           "allows half of this distance, rounded down")
      .add("min_gap_frames", &PlaceRecognitionSettings::min_gap_frames, {1, 1000000}, "frames",
           "smallest distance between the two keyframes of a loop")
      .add("candidates", &PlaceRecognitionSettings::candidates, {1, 100}, "",
           "largest number of candidates to verify per keyframe")
      .add("min_score", &PlaceRecognitionSettings::min_score, {0.0, 1.0}, "",
           "smallest score of a candidate: fraction of the points that voted for it, weighted by rarity")
      .add("view_radius_m", &PlaceRecognitionSettings::view_radius_m, {0.0, 1000.0}, "m",
           "distance within which keyframes are candidates by their pose, without descriptors")
      .add("min_share_in_view", &PlaceRecognitionSettings::min_share_in_view, {0.0, 1.0}, "",
           "smallest fraction of the points of a candidate by view_radius_m that project into the image");
}

void add_loop_verification(Table& table) {
  SettingsGroup(table, "loop_verification", &Settings::loop_verification)
      .add("max_descriptor_distance", &LoopVerificationSettings::max_descriptor_distance, {1, 256}, "bits",
           "largest Hamming distance of a match, of 256 bits")
      .add("descriptor_ratio", &LoopVerificationSettings::descriptor_ratio, {0.1, 1.0}, "",
           "largest ratio of best to second-best distance")
      .add("ransac_iterations", &LoopVerificationSettings::ransac_iterations, {1, 100000}, "",
           "largest number of samples of three points that RANSAC draws")
      .add("max_reprojection_error_px", &LoopVerificationSettings::max_reprojection_error_px, {0.1, 100.0},
           "px", "largest error of a RANSAC inlier, in (u, v, disparity)")
      .add("search_radius_px", &LoopVerificationSettings::search_radius_px, {0.5, 200.0}, "px",
           "guided matching: search radius around a predicted point")
      .add("pixel_sigma_px", &LoopVerificationSettings::pixel_sigma_px, {0.05, 10.0}, "px",
           "standard deviation of a detected corner")
      .add("covariance_scale", &LoopVerificationSettings::covariance_scale, {1.0, 1000.0}, "",
           "factor on the covariance of a loop, for errors that its points have in common")
      .add("min_inliers", &LoopVerificationSettings::min_inliers, {6, 10000}, "",
           "smallest number of inliers of a loop")
      .add("consecutive", &LoopVerificationSettings::consecutive, {1, 100}, "",
           "number of consecutive keyframes whose loops must agree")
      .add("relocalisation_inliers", &LoopVerificationSettings::relocalisation_inliers, {6, 10000}, "",
           "smallest number of inliers of a loop that alone gives a lost camera its place in the map")
      .add("max_chi2", &LoopVerificationSettings::max_chi2, {1.0, 1e6}, "",
           "largest squared Mahalanobis distance to the other loops and to the prediction; 22.458 is the "
           "99.9 % quantile of chi-square with 6 degrees of freedom")
      .add("gate_scale", &LoopVerificationSettings::gate_scale, {1.0, 1e6}, "",
           "factor on the covariances for max_chi2; 9 allows errors three times the standard deviation")
      .add("drift_m_per_m", &LoopVerificationSettings::drift_m_per_m, {0.0, 1.0}, "m/m",
           "allowed translation drift per metre by calibration errors that the covariance does not contain")
      .add("drift_rad_per_m", &LoopVerificationSettings::drift_rad_per_m, {0.0, 1.0}, "rad/m",
           "allowed rotation drift per metre by calibration errors that the covariance does not contain");
}

void add_pose_graph(Table& table) {
  SettingsGroup(table, "pose_graph", &Settings::pose_graph)
      .add("max_iterations", &PoseGraphSettings::max_iterations, {1, 10000}, "",
           "largest number of solver iterations")
      .add("loop_scale", &PoseGraphSettings::loop_scale, {0.1, 1e9}, "",
           "squared Mahalanobis distance above which the robust loss reduces a loop's weight");
}

Table make_table() {
  Table table;
  for (const auto add :
       {add_general, add_images, add_features, add_stereo, add_calibration, add_online_rectification,
        add_odometry, add_motion, add_association, add_refinement, add_update, add_map, add_keyframes,
        add_loop_closure, add_place_recognition, add_loop_verification, add_pose_graph}) {
    add(table);
  }
  return table;
}

}  // namespace

const std::vector<SettingsField>& settings_fields() {
  static const Table table = make_table();
  return table;
}

std::span<const RemovedKey> removed_keys() {
  static constexpr std::array<RemovedKey, 5> kRemoved = {
      {{"map.layout", "the preset decides: paper has one global map, the others have keyframes"},
       {"map.update_landmarks", "the preset paper updates its landmarks, the others do not"},
       {"map.track_correlation", "it is always kept, but by the preset paper"},
       {"refinement.enabled", "patches are always aligned, but with the preset paper"},
       {"update.method", "the presets paper and odometry have other methods than the default"}}};
  return kRemoved;
}

std::span<const RenamedKey> renamed_keys() {
  static constexpr std::array<RenamedKey, 6> kRenamed = {
      {{"rectification.refine", "online_rectification.enabled"},
       {"rectification.row_sigma_px", "online_rectification.row_sigma_px"},
       {"rectification.disparity_sigma_px", "online_rectification.disparity_sigma_px"},
       {"rectification.scale_sigma", "calibration.scale_sigma"},
       {"rectification.principal_point_sigma_px", "calibration.principal_point_sigma_px"},
       {"odometry.max_loop_error_px", "odometry.max_closure_error_px"}}};
  return kRenamed;
}

}  // namespace stereo_slam
