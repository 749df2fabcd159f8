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
      .add("clahe_tiles", &ImageSettings::clahe_tiles, {1, 64}, "", "CLAHE tiles per side of the image");
}

void add_features(Table& table) {
  SettingsGroup(table, "features", &Settings::features)
      .add("count", &FeatureSettings::count, {50, 20000}, "",
           "ORB features per image: with --preset paper in every frame, otherwise to recognise the last "
           "keyframe")
      .add("levels", &FeatureSettings::levels, {1, 12}, "", "pyramid levels")
      .add("scale_factor", &FeatureSettings::scale_factor, {1.01, 2.0}, "", "scale between pyramid levels")
      .add("cell_px", &FeatureSettings::cell_px, {8, 512}, "px", "grid cell over which features are spread")
      .add("fast_threshold", &FeatureSettings::fast_threshold, {1, 255}, "grey levels",
           "threshold of the FAST detector; the grid keeps the strongest corners");
}

void add_stereo(Table& table) {
  SettingsGroup(table, "stereo", &Settings::stereo)
      .add("max_disparity_px", &StereoMatchingSettings::max_disparity_px, {8, 2000}, "px",
           "largest disparity searched along the row")
      .add("min_disparity_px", &StereoMatchingSettings::min_disparity_px, {0.0, 50.0}, "px",
           "matches with a smaller disparity are dropped as wrong")
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
           "relative standard deviation of the calibrated scale (baseline times focal length), known "
           "beforehand")
      .add("principal_point_sigma_px", &CalibrationSettings::principal_point_sigma_px, {0.0, 50.0}, "px",
           "standard deviation of the calibrated principal point, known beforehand")
      .add("scale_sigma_per_px", &CalibrationSettings::scale_sigma_per_px, {0.0, 0.5}, "1/px",
           "relative standard deviation of the scale, per pixel of row offset found by online_rectification")
      .add("principal_point_per_px", &CalibrationSettings::principal_point_per_px, {0.0, 50.0}, "",
           "standard deviation of the principal point, per pixel of row offset from online_rectification");
}

void add_online_rectification(Table& table) {
  SettingsGroup(table, "online_rectification", &Settings::online_rectification)
      .add("enabled", &OnlineRectificationSettings::enabled,
           "estimate, while driving, the errors that rectification leaves")
      .add("row_sigma_px", &OnlineRectificationSettings::row_sigma_px, {0.001, 20.0}, "px",
           "prior standard deviation of the row offset at the image border")
      .add("disparity_sigma_px", &OnlineRectificationSettings::disparity_sigma_px, {0.001, 20.0}, "px",
           "prior standard deviation of the disparity offset at the image border, at most; less where the "
           "rows "
           "show a better calibration");
}

void add_odometry(Table& table) {
  SettingsGroup(table, "odometry", &Settings::odometry)
      .add("max_points", &OdometrySettings::max_points, {10, 10000}, "", "points tracked from frame to frame")
      .add("cell_px", &OdometrySettings::cell_px, {8, 512}, "px", "bucket over which the points are spread")
      .add("window_px", &OdometrySettings::window_px, {5, 21}, "px", "side of the optical-flow window")
      .add("pyramid_levels", &OdometrySettings::pyramid_levels, {1, 4}, "",
           "pyramid levels of the optical flow")
      .add("max_closure_error_px", &OdometrySettings::max_closure_error_px, {0.05, 20.0}, "px",
           "circular matching (--preset paper): largest distance between start and end of the circle")
      .add("max_row_error_px", &OdometrySettings::max_row_error_px, {0.05, 20.0}, "px",
           "largest row difference of left and right point (epipolar check)")
      .add("ransac_iterations", &OdometrySettings::ransac_iterations, {1, 100000}, "",
           "three-point hypotheses of RANSAC")
      .add("min_inliers", &OdometrySettings::min_inliers, {3, 10000}, "",
           "with fewer inliers the motion is not used")
      .add("pixel_sigma_px", &OdometrySettings::pixel_sigma_px, {0.01, 10.0}, "px",
           "standard deviation of a tracked coordinate, for the choice of inliers")
      .add("exclusion_px", &OdometrySettings::exclusion_px, {0.0, 100.0}, "px",
           "smallest distance between points of the odometry and of the filter, and between new corners");
}

void add_motion(Table& table) {
  SettingsGroup(table, "motion", &Settings::motion)
      .add("covariance_scale", &MotionSettings::covariance_scale, {0.01, 100.0}, "",
           "factor on the odometry's covariance")
      .add("min_rotation_sigma_rad", &MotionSettings::min_rotation_sigma_rad, {1e-6, 0.1}, "rad",
           "rotation noise added to the odometry's, per axis and frame")
      .add("min_translation_sigma_m", &MotionSettings::min_translation_sigma_m, {1e-6, 10.0}, "m",
           "translation noise added to the odometry's, per axis and frame")
      .add("lost_rotation_sigma_rad", &MotionSettings::lost_rotation_sigma_rad, {1e-6, 0.1}, "rad",
           "rotation noise of a frame without odometry, per axis")
      .add("lost_translation_sigma_m", &MotionSettings::lost_translation_sigma_m, {1e-6, 100.0}, "m",
           "translation noise of a frame without odometry, per axis");
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
           "flow gate: largest difference of observed and predicted flow")
      .add("flow_relative_tolerance", &AssociationSettings::flow_relative_tolerance, {0.0, 10.0}, "",
           "flow gate: further tolerance as a share of the flow's length");
}

void add_refinement(Table& table) {
  SettingsGroup(table, "refinement", &Settings::refinement)
      .add("enabled", &RefinementSettings::enabled,
           "measure landmarks to sub-pixel accuracy by aligning the keyframe's patches")
      .add("min_correlation", &RefinementSettings::min_correlation, {-1.0, 1.0}, "",
           "smallest correlation of the aligned patches")
      .add("max_shift_px", &RefinementSettings::max_shift_px, {0.1, 20.0}, "px",
           "largest shift of the alignment from its start")
      .add("max_row_error_px", &RefinementSettings::max_row_error_px, {0.05, 20.0}, "px",
           "largest row difference of left and right position (epipolar check)")
      .add("pixel_sigma_px", &RefinementSettings::pixel_sigma_px, {0.01, 10.0}, "px",
           "standard deviation of an aligned coordinate beyond what its patch tells")
      .add("gate_sigma_px", &RefinementSettings::gate_sigma_px, {0.01, 10.0}, "px",
           "standard deviation of an aligned coordinate in the innovation gate");
}

void add_update(Table& table) {
  SettingsGroup(table, "update", &Settings::update)
      .add("method", &UpdateSettings::method,
           {{"paper", PoseUpdateMethod::kPaper},
            {"progressive", PoseUpdateMethod::kProgressive},
            {"quadratic", PoseUpdateMethod::kQuadratic},
            {"none", PoseUpdateMethod::kNone}},
           "pose update; paper: Alg. 2 as published, none: odometry alone")
      .add("tau", &UpdateSettings::tau, {0.001, 0.99}, "",
           "smallest likelihood ratio within a progression step (methods paper and progressive)")
      .add("max_correspondences", &UpdateSettings::max_correspondences, {3, 100000}, "",
           "matches per subset (method paper)")
      .add("regularizer_sigma_m", &UpdateSettings::regularizer_sigma_m, {0.0, 1.0}, "m",
           "translation noise added between subsets (method paper)")
      .add("regularizer_forgetting", &UpdateSettings::regularizer_forgetting, {0.0, 1e-3}, "",
           "relative widening of the orientation between subsets (method paper)")
      .add("robust_cap", &UpdateSettings::robust_cap, {1.0, 1e6}, "",
           "squared Mahalanobis distance above which a match has no further influence")
      .add("min_matches", &UpdateSettings::min_matches, {3, 100000}, "",
           "with fewer matches the pose is predicted only");
}

void add_map(Table& table) {
  SettingsGroup(table, "map", &Settings::map)
      .add("layout", &MapSettings::layout,
           {{"anchored", MapLayout::kAnchored}, {"global", MapLayout::kGlobal}},
           "anchored: state relative to the last keyframe; global: the paper's single map")
      .add("max_new_landmarks", &MapSettings::max_new_landmarks, {10, 100000}, "",
           "new landmarks per keyframe (anchored) or frame (global)")
      .add("cell_px", &MapSettings::cell_px, {8, 512}, "px", "bucket over which new landmarks are spread")
      .add("inverse_depth_beyond_baselines", &MapSettings::inverse_depth_beyond_baselines, {0.0, 1e6},
           "baselines", "depth from which landmarks are held in inverse depth")
      .add("max_baselines", &MapSettings::max_baselines, {1.0, 1e6}, "baselines",
           "depth beyond which landmarks are not used")
      .add("pixel_sigma_px", &MapSettings::pixel_sigma_px, {0.01, 10.0}, "px",
           "standard deviation of a new landmark's coordinates beyond what its patch tells")
      .add("update_landmarks", &MapSettings::update_landmarks, "update landmarks after every pose (Alg. 4)")
      .add("track_correlation", &MapSettings::track_correlation,
           "track the correlation of pose and landmark errors; anchored layout without update_landmarks")
      .add("cull_after_frames", &MapSettings::cull_after_frames, {1, 100000}, "frames",
           "landmarks not observed for longer are dropped");
}

void add_keyframes(Table& table) {
  SettingsGroup(table, "keyframes", &Settings::keyframes)
      .add("min_match_ratio", &KeyframeSettings::min_match_ratio, {0.0, 1.0}, "",
           "a lower ratio of matched landmarks to the keyframe's triggers a new keyframe")
      .add("min_matches", &KeyframeSettings::min_matches, {0, 100000}, "",
           "fewer matches trigger a new keyframe")
      .add("max_frames", &KeyframeSettings::max_frames, {1, 100000}, "frames",
           "largest distance between keyframes");
}

void add_loop_closure(Table& table) {
  SettingsGroup(table, "loop_closure", &Settings::loop_closure)
      .add("enabled", &LoopClosureSettings::enabled, "close loops; anchored layout only")
      .add("max_points", &LoopClosureSettings::max_points, {50, 10000}, "",
           "points that a keyframe keeps for place recognition")
      .add("latency_frames", &LoopClosureSettings::latency_frames, {1, 1000}, "frames",
           "delay from a keyframe to the correction by its loop")
      .add("spacing_m", &LoopClosureSettings::spacing_m, {0.0, 1000.0}, "m",
           "path between the loops of one revisit");
}

void add_place_recognition(Table& table) {
  SettingsGroup(table, "place_recognition", &Settings::place_recognition)
      .add("trees", &PlaceRecognitionSettings::trees, {1, 16}, "",
           "descriptor trees; each splits by its own bits")
      .add("leaf_size", &PlaceRecognitionSettings::leaf_size, {4, 10000}, "",
           "descriptors at which a leaf is split")
      .add("max_descriptor_distance", &PlaceRecognitionSettings::max_descriptor_distance, {1, 256}, "bits",
           "largest Hamming distance between views of one point, of 256 bits")
      .add("min_gap_frames", &PlaceRecognitionSettings::min_gap_frames, {1, 1000000}, "frames",
           "smallest distance of a loop's two keyframes")
      .add("candidates", &PlaceRecognitionSettings::candidates, {1, 100}, "",
           "largest number of candidates to verify per keyframe")
      .add("min_score", &PlaceRecognitionSettings::min_score, {0.0, 1.0}, "",
           "smallest score of a candidate: share of the points that voted for it, weighted by rarity")
      .add("view_radius_m", &PlaceRecognitionSettings::view_radius_m, {0.0, 1000.0}, "m",
           "keyframes within this distance are candidates by their pose alone")
      .add("min_share_in_view", &PlaceRecognitionSettings::min_share_in_view, {0.0, 1.0}, "",
           "smallest share of such a keyframe's points that project into the image");
}

void add_loop_verification(Table& table) {
  SettingsGroup(table, "loop_verification", &Settings::loop_verification)
      .add("max_descriptor_distance", &LoopVerificationSettings::max_descriptor_distance, {1, 256}, "bits",
           "largest Hamming distance of a match, of 256 bits")
      .add("descriptor_ratio", &LoopVerificationSettings::descriptor_ratio, {0.1, 1.0}, "",
           "largest ratio of best to second-best distance")
      .add("ransac_iterations", &LoopVerificationSettings::ransac_iterations, {1, 100000}, "",
           "P3P hypotheses of RANSAC")
      .add("max_reprojection_error_px", &LoopVerificationSettings::max_reprojection_error_px, {0.1, 100.0},
           "px", "largest reprojection error of a RANSAC inlier")
      .add("search_radius_px", &LoopVerificationSettings::search_radius_px, {0.5, 200.0}, "px",
           "guided matching: search radius around a predicted point")
      .add("pixel_sigma_px", &LoopVerificationSettings::pixel_sigma_px, {0.05, 10.0}, "px",
           "standard deviation of a detected corner")
      .add("min_inliers", &LoopVerificationSettings::min_inliers, {6, 10000}, "",
           "smallest number of inliers of a loop")
      .add("consecutive", &LoopVerificationSettings::consecutive, {1, 100}, "",
           "consecutive keyframes whose loops must agree")
      .add("max_chi2", &LoopVerificationSettings::max_chi2, {1.0, 1e6}, "",
           "largest squared Mahalanobis distance to the other loops and to the prediction; 22.458 is the "
           "99.9 % quantile of chi-square with 6 degrees of freedom")
      .add("gate_scale", &LoopVerificationSettings::gate_scale, {1.0, 1e6}, "",
           "factor on the covariances of that distance; 9 allows errors three times the standard deviation")
      .add("drift_m_per_m", &LoopVerificationSettings::drift_m_per_m, {0.0, 1.0}, "m/m",
           "allowance for translation drift by errors of the calibration that no covariance contains")
      .add("drift_rad_per_m", &LoopVerificationSettings::drift_rad_per_m, {0.0, 1.0}, "rad/m",
           "allowance for rotation drift by the same errors");
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
