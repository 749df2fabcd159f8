// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>

/// Every setting of the SLAM and its default. The meaning, unit and range of each setting are in schema.cpp
/// only; the YAML reader checks values against the range, and `stereo_slam --print-settings` prints all
/// three.
namespace stereo_slam {

/// Preparation of the images.
struct ImageSettings {
  bool clahe = false;
  double clahe_clip_limit = 3.0;
  int clahe_tiles = 8;
};

/// Corner detection and description.
struct FeatureSettings {
  int count = 1000;
  int levels = 4;
  double scale_factor = 1.2;
  int cell_px = 32;
  int fast_threshold = 6;
};

/// Disparity of single points.
struct StereoMatchingSettings {
  int max_disparity_px = 160;
  double min_disparity_px = 0.3;
  double max_row_error_px = 1.0;
  double uniqueness = 0.8;
  double min_correlation = 0.85;
};

/// Errors of the calibration that are the same in every frame. They are not estimated, but the covariances
/// contain them.
struct CalibrationSettings {
  double scale_sigma = 0.0;
  double principal_point_sigma_px = 0.0;
  double common_error_px = 0.008;
  double scale_sigma_per_px = 0.01;
  double principal_point_per_px = 1.0;
};

/// Online estimation of the rectification errors that the calibration leaves.
struct OnlineRectificationSettings {
  bool enabled = true;
  double row_sigma_px = 2.0;
  double disparity_sigma_px = 0.7;
};

/// Frame-to-frame stereo odometry, the system input u_k.
struct OdometrySettings {
  int max_points = 300;
  double exclusion_px = 4.0;
  int cell_px = 50;
  int window_px = 9;
  int pyramid_levels = 4;
  double max_closure_error_px = 1.0;
  double max_row_error_px = 1.5;
  int ransac_iterations = 200;
  int min_inliers = 12;
  double pixel_sigma_px = 0.4;
};

/// Noise v_k of the prediction (eq. 11): the odometry's covariance plus a floor.
struct MotionSettings {
  double covariance_scale = 1.0;
  double min_rotation_sigma_rad = 2e-4;
  double min_translation_sigma_m = 2e-3;
  double lost_rotation_sigma_rad = 0.03;
  double lost_translation_sigma_m = 0.5;
};

/// Data association (sec. IV-C).
struct AssociationSettings {
  double feature_sigma_px = 1.0;
  int max_descriptor_distance = 64;
  double descriptor_ratio = 0.9;
  double max_row_error_px = 2.0;
  int flow_window_px = 15;
  double flow_tolerance_px = 3.0;
  double flow_relative_tolerance = 0.2;
};

/// Sub-pixel measurement of the reference keyframe's landmarks.
struct RefinementSettings {
  double min_correlation = 0.8;
  double max_shift_px = 3.0;
  double max_row_error_px = 1.0;
  double pixel_sigma_px = 0.05;
  double gate_sigma_px = 1.0;
};

/// How the landmarks correct the predicted pose.
enum class PoseUpdateMethod {
  kPaper,  ///< Alg. 2 with 7 x 7 points; orientation and translation independent; subsets of the matches
  kProgressive,  ///< Alg. 2 with degree-5 points; orientation and translation coupled
  kQuadratic,    ///< antipode::quadratic_update: quadratic fits of the log-likelihood
};

/// Pose update (sec. III-B and IV-D).
struct UpdateSettings {
  PoseUpdateMethod method = PoseUpdateMethod::kQuadratic;
  double tau = 0.5;
  int max_correspondences = 30;
  double regularizer_sigma_m = 1e-3;
  double regularizer_forgetting = 1e-3;
  double robust_cap = 16.0;
  double student_t_inverse_dof = 0.15;
  int min_matches = 10;
  bool noise_from_residuals = true;
};

/// Landmarks (sec. IV-E).
struct MapSettings {
  int max_new_landmarks = 500;
  int cell_px = 40;
  double inverse_depth_beyond_baselines = 40.0;
  double max_baselines = 140.0;
  double clear_correlation = 0.95;
  double pixel_sigma_px = 0.075;
  int cull_after_frames = 5;
};

/// When a new keyframe is taken.
struct KeyframeSettings {
  double min_match_ratio = 0.6;
  int min_matches = 60;
  int max_frames = 20;
};

/// Search for earlier keyframes that look like the current one.
struct PlaceRecognitionSettings {
  int trees = 4;
  int leaf_size = 48;
  int max_descriptor_distance = 32;
  int min_gap_frames = 60;
  int candidates = 3;
  double min_score = 0.01;
  double view_radius_m = 10.0;
  double min_share_in_view = 0.5;
};

/// Geometric check of a loop candidate.
struct LoopVerificationSettings {
  int max_descriptor_distance = 64;
  double descriptor_ratio = 0.9;
  int ransac_iterations = 1000;
  double max_reprojection_error_px = 4.0;
  double search_radius_px = 8.0;
  double pixel_sigma_px = 1.0;
  double covariance_scale = 2.0;
  int min_inliers = 25;
  int consecutive = 3;
  int relocalisation_inliers = 60;
  double max_chi2 = 22.458;
  double gate_scale = 1.0;
  double drift_m_per_m = 0.003;
  double drift_rad_per_m = 1e-5;
};

/// Optimisation over the keyframes' poses.
struct PoseGraphSettings {
  int max_iterations = 50;
  double loop_scale = 22.458;
};

/// Loop closing, from recognition to correction.
struct LoopClosureSettings {
  bool enabled = true;
  int max_points = 500;
  int latency_frames = 15;
  double spacing_baselines = 18.6;
};

/// What follows the camera.
enum class Program {
  kSlam,      ///< landmarks relative to a keyframe, loops
  kPaper,     ///< the DQV-SLAM paper as published
  kOdometry,  ///< as kSlam, but the landmarks do not correct the pose: the odometry alone, as a baseline
};

struct Settings {
  std::string preset = "default";    ///< the preset that the other values started from
  Program program = Program::kSlam;  ///< that of the preset
  std::uint64_t seed = 1;
  ImageSettings images;
  FeatureSettings features;
  StereoMatchingSettings stereo;
  CalibrationSettings calibration;
  OnlineRectificationSettings online_rectification;
  OdometrySettings odometry;
  MotionSettings motion;
  AssociationSettings association;
  RefinementSettings refinement;
  UpdateSettings update;
  MapSettings map;
  KeyframeSettings keyframes;
  LoopClosureSettings loop_closure;
  PlaceRecognitionSettings place_recognition;
  LoopVerificationSettings loop_verification;
  PoseGraphSettings pose_graph;
};

}  // namespace stereo_slam
