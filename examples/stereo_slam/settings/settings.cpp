// SPDX-License-Identifier: MIT
// The one table of all settings, and the presets. A new setting takes one line here and a member in
// settings.hpp.
#include "stereo_slam/settings/settings.hpp"

#include <cstdint>
#include <limits>

#include "stereo_slam/settings/settings_io.hpp"
#include "stereo_slam/settings/settings_table.hpp"

namespace stereo_slam {
namespace {

std::vector<SettingsField> make_table() {
  std::vector<SettingsField> table;

  SettingsGroup(table, "").add("seed", &Settings::seed, {0, std::numeric_limits<std::uint64_t>::max()}, "",
                               "of every random draw");

  SettingsGroup(table, "images", &Settings::images)
      .add("clahe", &ImageSettings::clahe, "equalise the contrast locally; for dark or unevenly lit images")
      .add("clahe_clip_limit", &ImageSettings::clahe_clip_limit, {1.0, 100.0}, "",
           "steepest slope of the grey-value curve")
      .add("clahe_tiles", &ImageSettings::clahe_tiles, {1, 64}, "", "a side of the image");

  SettingsGroup(table, "features", &Settings::features)
      .add("count", &FeatureSettings::count, {50, 20000}, "", "ORB features an image")
      .add("levels", &FeatureSettings::levels, {1, 12}, "", "pyramid levels")
      .add("scale_factor", &FeatureSettings::scale_factor, {1.01, 2.0}, "", "between pyramid levels")
      .add("cell_px", &FeatureSettings::cell_px, {8, 512}, "px", "grid cell over which features are spread")
      .add("fast_threshold", &FeatureSettings::fast_threshold, {1, 255}, "grey levels",
           "of the corner detector; the grid picks the strongest");

  SettingsGroup(table, "stereo", &Settings::stereo)
      .add("max_disparity_px", &StereoMatchingSettings::max_disparity_px, {8, 2000}, "px",
           "widest search along the row")
      .add("min_disparity_px", &StereoMatchingSettings::min_disparity_px, {0.0, 50.0}, "px",
           "nearer to zero is taken for a wrong match")
      .add("max_row_error_px", &StereoMatchingSettings::max_row_error_px, {0.05, 20.0}, "px",
           "epipolar check")
      .add("uniqueness", &StereoMatchingSettings::uniqueness, {0.1, 1.0}, "", "best cost over second best")
      .add("min_correlation", &StereoMatchingSettings::min_correlation, {-1.0, 1.0}, "",
           "of the aligned patches");

  SettingsGroup(table, "rectification", &Settings::rectification)
      .add("refine", &RectificationSettings::refine,
           "estimate what rectification has left over, while driving")
      .add("row_sigma_px", &RectificationSettings::row_sigma_px, {0.001, 20.0}, "px",
           "prior spread of the row offset at the image border")
      .add("disparity_sigma_px", &RectificationSettings::disparity_sigma_px, {0.001, 20.0}, "px",
           "prior spread of the disparity offset at the image border")
      .add("scale_sigma", &RectificationSettings::scale_sigma, {0.0, 0.5}, "",
           "relative error of the calibrated baseline, common to all lengths")
      .add("principal_point_sigma_px", &RectificationSettings::principal_point_sigma_px, {0.0, 50.0}, "px",
           "error of the calibrated principal point, common to all frames");

  SettingsGroup(table, "odometry", &Settings::odometry)
      .add("max_points", &OdometrySettings::max_points, {10, 10000}, "",
           "points followed from frame to frame")
      .add("cell_px", &OdometrySettings::cell_px, {8, 512}, "px", "bucket over which the points are spread")
      .add("window_px", &OdometrySettings::window_px, {5, 21}, "px", "side of the flow window")
      .add("pyramid_levels", &OdometrySettings::pyramid_levels, {0, 8}, "", "of the flow")
      .add("max_loop_error_px", &OdometrySettings::max_loop_error_px, {0.05, 20.0}, "px",
           "circular matching: distance between start and end of the circle")
      .add("max_row_error_px", &OdometrySettings::max_row_error_px, {0.05, 20.0}, "px", "epipolar check")
      .add("ransac_iterations", &OdometrySettings::ransac_iterations, {1, 100000}, "",
           "three-point hypotheses")
      .add("min_inliers", &OdometrySettings::min_inliers, {3, 10000}, "", "fewer make the motion unreliable")
      .add("pixel_sigma_px", &OdometrySettings::pixel_sigma_px, {0.01, 10.0}, "px",
           "standard deviation of a tracked coordinate")
      .add("exclusion_px", &OdometrySettings::exclusion_px, {0.0, 100.0}, "px",
           "kept between the odometry's points and those of the filter");

  SettingsGroup(table, "motion", &Settings::motion)
      .add("covariance_scale", &MotionSettings::covariance_scale, {0.01, 100.0}, "",
           "factor on the odometry's covariance")
      .add("min_rotation_sigma_rad", &MotionSettings::min_rotation_sigma_rad, {1e-6, 0.1}, "rad",
           "added to the odometry's noise")
      .add("min_translation_sigma_m", &MotionSettings::min_translation_sigma_m, {1e-6, 10.0}, "m",
           "added to the odometry's noise")
      .add("lost_rotation_sigma_rad", &MotionSettings::lost_rotation_sigma_rad, {1e-6, 0.1}, "rad",
           "of a frame without odometry")
      .add("lost_translation_sigma_m", &MotionSettings::lost_translation_sigma_m, {1e-6, 100.0}, "m",
           "of a frame without odometry");

  SettingsGroup(table, "association", &Settings::association)
      .add("feature_sigma_px", &AssociationSettings::feature_sigma_px, {0.05, 10.0}, "px",
           "localisation noise of a detected corner")
      .add("max_descriptor_distance", &AssociationSettings::max_descriptor_distance, {1, 256}, "bits",
           "of 256")
      .add("descriptor_ratio", &AssociationSettings::descriptor_ratio, {0.1, 1.0}, "",
           "best over second best distance in the search region")
      .add("max_row_error_px", &AssociationSettings::max_row_error_px, {0.05, 20.0}, "px",
           "epipolar coherence")
      .add("flow_window_px", &AssociationSettings::flow_window_px, {5, 21}, "px", "side of the flow window")
      .add("flow_tolerance_px", &AssociationSettings::flow_tolerance_px, {0.1, 100.0}, "px",
           "observed against predicted flow")
      .add("flow_relative_tolerance", &AssociationSettings::flow_relative_tolerance, {0.0, 10.0}, "",
           "the same in parts of the flow's length");

  SettingsGroup(table, "refinement", &Settings::refinement)
      .add("enabled", &RefinementSettings::enabled, "measure landmarks by aligning the keyframe's patches")
      .add("min_correlation", &RefinementSettings::min_correlation, {-1.0, 1.0}, "", "of the aligned patches")
      .add("max_shift_px", &RefinementSettings::max_shift_px, {0.1, 20.0}, "px",
           "from where the alignment starts")
      .add("max_row_error_px", &RefinementSettings::max_row_error_px, {0.05, 20.0}, "px",
           "epipolar coherence")
      .add("pixel_sigma_px", &RefinementSettings::pixel_sigma_px, {0.01, 10.0}, "px",
           "noise of an aligned coordinate")
      .add("gate_sigma_px", &RefinementSettings::gate_sigma_px, {0.01, 10.0}, "px",
           "the same in the innovation gate");

  SettingsGroup(table, "update", &Settings::update)
      .add("method", &UpdateSettings::method,
           {{"paper", PoseUpdateMethod::kPaper},
            {"progressive", PoseUpdateMethod::kProgressive},
            {"quadratic", PoseUpdateMethod::kQuadratic},
            {"none", PoseUpdateMethod::kNone}},
           "how the pose is corrected")
      .add("tau", &UpdateSettings::tau, {0.001, 0.99}, "",
           "smallest likelihood ratio within a progression step")
      .add("max_correspondences", &UpdateSettings::max_correspondences, {3, 100000}, "",
           "in a subset (method paper)")
      .add("regularizer_sigma_m", &UpdateSettings::regularizer_sigma_m, {0.0, 1.0}, "m",
           "added to the translation between subsets (method paper)")
      .add("regularizer_forgetting", &UpdateSettings::regularizer_forgetting, {0.0, 1e-3}, "",
           "relative widening of the orientation between subsets (method paper)")
      .add("robust_cap", &UpdateSettings::robust_cap, {1.0, 1e6}, "",
           "squared Mahalanobis distance beyond which a match counts no further")
      .add("min_matches", &UpdateSettings::min_matches, {3, 100000}, "",
           "fewer leave the prediction as it is");

  SettingsGroup(table, "map", &Settings::map)
      .add("layout", &MapSettings::layout,
           {{"anchored", MapLayout::kAnchored}, {"global", MapLayout::kGlobal}},
           "state relative to the last keyframe, or the paper's global map")
      .add("max_new_landmarks", &MapSettings::max_new_landmarks, {10, 100000}, "",
           "a keyframe, or a frame of the global layout")
      .add("cell_px", &MapSettings::cell_px, {8, 512}, "px", "bucket over which landmarks are spread")
      .add("inverse_depth_beyond_baselines", &MapSettings::inverse_depth_beyond_baselines, {0.0, 1e6},
           "baselines", "farther landmarks are held in inverse depth")
      .add("max_baselines", &MapSettings::max_baselines, {1.0, 1e6}, "baselines",
           "farther landmarks are not used")
      .add("pixel_sigma_px", &MapSettings::pixel_sigma_px, {0.01, 10.0}, "px",
           "noise of a new landmark's measurement")
      .add("update_landmarks", &MapSettings::update_landmarks, "Alg. 4 after every pose update")
      .add("track_correlation", &MapSettings::track_correlation,
           "of the pose's error with the landmarks', in the anchored layout without update_landmarks")
      .add("cull_after_frames", &MapSettings::cull_after_frames, {1, 100000}, "frames",
           "landmarks unseen for longer are dropped");

  SettingsGroup(table, "keyframes", &Settings::keyframes)
      .add("min_match_ratio", &KeyframeSettings::min_match_ratio, {0.0, 1.0}, "",
           "matched landmarks over the keyframe's; fewer call for a new keyframe")
      .add("min_matches", &KeyframeSettings::min_matches, {0, 100000}, "", "fewer call for a new keyframe")
      .add("max_frames", &KeyframeSettings::max_frames, {1, 100000}, "frames", "longest life of a keyframe");

  SettingsGroup(table, "loop_closure", &Settings::loop_closure)
      .add("enabled", &LoopClosureSettings::enabled,
           "recognise places and correct the drift; anchored layout only")
      .add("max_points", &LoopClosureSettings::max_points, {50, 10000}, "",
           "a keyframe keeps for recognition")
      .add("latency_frames", &LoopClosureSettings::latency_frames, {1, 1000}, "frames",
           "from a keyframe to the correction that its loop brings");

  SettingsGroup(table, "place_recognition", &Settings::place_recognition)
      .add("trees", &PlaceRecognitionSettings::trees, {1, 16}, "",
           "each splits descriptors by bits of its own")
      .add("leaf_size", &PlaceRecognitionSettings::leaf_size, {4, 10000}, "",
           "descriptors in a leaf before it is split")
      .add("max_descriptor_distance", &PlaceRecognitionSettings::max_descriptor_distance, {1, 256}, "bits",
           "between views of one point")
      .add("min_gap_frames", &PlaceRecognitionSettings::min_gap_frames, {1, 1000000}, "frames",
           "younger keyframes are no loop")
      .add("candidates", &PlaceRecognitionSettings::candidates, {1, 100}, "",
           "handed on for verification, at most")
      .add("min_score", &PlaceRecognitionSettings::min_score, {0.0, 1.0}, "",
           "of a candidate: share of the points that voted, rare ones counting more")
      .add("view_radius_m", &PlaceRecognitionSettings::view_radius_m, {0.0, 1000.0}, "m",
           "keyframes as near are candidates by their place alone")
      .add("min_share_in_view", &PlaceRecognitionSettings::min_share_in_view, {0.0, 1.0}, "",
           "of the points of such a keyframe that should be seen");

  SettingsGroup(table, "loop_verification", &Settings::loop_verification)
      .add("max_descriptor_distance", &LoopVerificationSettings::max_descriptor_distance, {1, 256}, "bits",
           "of 256")
      .add("descriptor_ratio", &LoopVerificationSettings::descriptor_ratio, {0.1, 1.0}, "",
           "best over second best distance")
      .add("ransac_iterations", &LoopVerificationSettings::ransac_iterations, {1, 100000}, "",
           "perspective three-point hypotheses")
      .add("max_reprojection_error_px", &LoopVerificationSettings::max_reprojection_error_px, {0.1, 100.0},
           "px", "of an inlier of RANSAC")
      .add("search_radius_px", &LoopVerificationSettings::search_radius_px, {0.5, 200.0}, "px",
           "guided matching: from where a point is predicted")
      .add("pixel_sigma_px", &LoopVerificationSettings::pixel_sigma_px, {0.05, 10.0}, "px",
           "localisation noise of a corner")
      .add("min_inliers", &LoopVerificationSettings::min_inliers, {6, 10000}, "", "fewer do not make a loop")
      .add("consecutive", &LoopVerificationSettings::consecutive, {1, 100}, "",
           "keyframes in a row whose loops must agree")
      .add("max_chi2", &LoopVerificationSettings::max_chi2, {1.0, 1e6}, "",
           "squared Mahalanobis distance at which loops disagree, with each other or with the prediction")
      .add("gate_scale", &LoopVerificationSettings::gate_scale, {1.0, 1e6}, "",
           "factor on the covariances by which a loop is compared with others and with the prediction")
      .add("drift_m_per_m", &LoopVerificationSettings::drift_m_per_m, {0.0, 1.0}, "m/m",
           "allowance for systematic errors of the distance")
      .add("drift_rad_per_m", &LoopVerificationSettings::drift_rad_per_m, {0.0, 1.0}, "rad/m",
           "allowance for systematic errors of the direction");

  SettingsGroup(table, "pose_graph", &Settings::pose_graph)
      .add("max_iterations", &PoseGraphSettings::max_iterations, {1, 10000}, "", "of the solver")
      .add("loop_scale", &PoseGraphSettings::loop_scale, {0.1, 1e9}, "",
           "squared Mahalanobis distance beyond which a loop loses its say");

  return table;
}

/// What measures best.
void apply_default(Settings&) {}

/// The DQV-SLAM paper's choices, section IV: detected corners as measurements, one global map with landmarks
/// updated in every frame, 7 x 7 pose samples, no correlation, subsets of 30. The paper does not give tau.
void apply_paper(Settings& settings) {
  settings.rectification.refine = false;
  settings.rectification.scale_sigma = 0.0;
  settings.rectification.principal_point_sigma_px = 0.0;
  settings.refinement.enabled = false;
  settings.update.method = PoseUpdateMethod::kPaper;
  settings.update.tau = 0.05;
  settings.map.layout = MapLayout::kGlobal;
  settings.map.update_landmarks = true;
  settings.map.pixel_sigma_px = settings.association.feature_sigma_px;
  settings.loop_closure.enabled = false;
}

/// The system input alone.
void apply_odometry(Settings& settings) {
  settings.update.method = PoseUpdateMethod::kNone;
  settings.loop_closure.enabled = false;
}

}  // namespace

const std::vector<SettingsField>& settings_fields() {
  static const std::vector<SettingsField> table = make_table();
  return table;
}

const std::vector<Preset>& presets() {
  static const std::vector<Preset> list = {
      {"default", "what measures best", apply_default},
      {"paper", "the DQV-SLAM paper's algorithm as published", apply_paper},
      {"odometry", "the stereo odometry alone, as a baseline", apply_odometry},
  };
  return list;
}

}  // namespace stereo_slam
