// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>

/// Every setting of the SLAM and its default, and what only presets and tests change, which has a comment
/// here. The meaning, unit and range of each setting are in schema.cpp only; the YAML reader checks values
/// against the range, and `stereo_slam --print-settings` prints all three. Most other
/// numbers are constants beside their use.
#include "stereo_slam/core/pixel_noise.hpp"

namespace stereo_slam {

/// Preparation of the images.
struct ImageSettings {
  bool clahe = false;
};

/// Corner detection and description.
struct FeatureSettings {
  int count = 1000;
};

/// Disparity of single points.
struct StereoMatchingSettings {
  int max_disparity_px = 160;
  double uniqueness = 0.8;  ///< largest ratio of best to second-best matching cost
};

/// Errors of the calibration that are the same in every frame. They are not estimated, but the covariances
/// contain them.
struct CalibrationSettings {
  double scale_sigma = 0.0;
  double principal_point_sigma_px = 0.0;
  double common_error_px = kCommonError_px;
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
  /// Smallest distance between points of the odometry and landmarks of the filter, and between new corners.
  double exclusion_px = 4.0;
  int cell_px = 50;               ///< grid cell over which points are spread
  int window_px = 9;              ///< side of the optical-flow window
  int pyramid_levels = 4;         ///< number of pyramid levels of the optical flow
  double max_row_error_px = 1.5;  ///< largest row difference of left and right point (epipolar check)
  int ransac_iterations = 200;    ///< largest number of three-point hypotheses of RANSAC
  int min_inliers = 12;           ///< smallest number of inliers; with fewer the measured motion is not used
  double pixel_sigma_px = kOdometrySigma_px;
};

/// Noise v_k of the prediction (eq. 11) of a frame without odometry; that of the first such frame is smaller
/// if the last motions were constant.
struct MotionSettings {
  double lost_rotation_sigma_rad = 0.03;
  double lost_translation_sigma_m = 0.5;
};

/// Data association (sec. IV-C).
struct AssociationSettings {
  double feature_sigma_px = kCornerSigma_px;  ///< standard deviation of a detected corner
  double max_row_error_px = 2.0;              ///< largest row difference of a stereo match (epipolar check)
  /// Flow gate: largest difference between observed and predicted optical flow.
  double flow_tolerance_px = 3.0;
};

/// Sub-pixel measurement of the reference keyframe's landmarks.
struct RefinementSettings {
  double pixel_sigma_px = kPatchSigma_px;
};

/// How the landmarks correct the predicted pose. (PaperSlam has its own way: Alg. 2 with 7 x 7 points.)
enum class PoseUpdateMethod {
  kQuadratic,     ///< antipode::quadratic_update: quadratic fits of the log-likelihood to samples
  kLeastSquares,  ///< antipode::robust_least_squares: Gauss-Newton steps with derivatives
};

/// Pose update (sec. III-B and IV-D).
struct UpdateSettings {
  PoseUpdateMethod method = PoseUpdateMethod::kQuadratic;
  double tau = 0.5;  ///< smallest likelihood ratio within a progression step (--preset paper)
  /// Squared Mahalanobis distance beyond which a match is removed after the first update.
  double robust_cap = 16.0;
  /// 1 / degrees of freedom of the Student-t distribution of the errors of matches: the larger, the less
  /// weight have large residuals; 0: normal distribution, equal weights.
  double student_t_inverse_dof = 0.15;
  int min_matches = 10;  ///< smallest number of matches; with fewer the pose is only predicted
  bool noise_from_residuals = true;
};

/// Landmarks (sec. IV-E).
struct MapSettings {
  int max_new_landmarks = 500;
  int cell_px = 40;  ///< grid cell over which new landmarks are spread
  double max_baselines = 140.0;
  /// Landmarks whose patches correlate less in the two images, or are near and on no common surface, are
  /// added only where there would be fewer than half of max_new_landmarks without them; -1: all are added.
  double clear_correlation = 0.95;
  double pixel_sigma_px = kLandmarkSigma_px;
  int cull_after_frames = 5;  ///< time after which a landmark that is not observed is dropped
};

/// When a new keyframe is taken.
struct KeyframeSettings {
  double min_match_ratio = 0.6;
  int min_matches = 60;  ///< a new keyframe is taken if fewer landmarks are matched
  int max_frames = 20;
};

/// Search for earlier keyframes that look like the current one.
struct PlaceRecognitionSettings {
  /// Number of binary trees; they keep the first and the second half of each descriptor in turn.
  int trees = 4;
  /// Largest Hamming distance between views of one point, of 256 bits; a tree compares 128 bits and allows
  /// half of this distance, rounded down.
  int max_descriptor_distance = 32;
  int min_gap_frames = 60;  ///< smallest distance between the two keyframes of a loop
};

/// Geometric check of a loop candidate.
struct LoopVerificationSettings {
  int ransac_iterations = 1000;             ///< largest number of samples of three points that RANSAC draws
  double pixel_sigma_px = kCornerSigma_px;  ///< standard deviation of a detected corner
  int min_inliers = 25;                     ///< smallest number of inliers of a loop
  /// Smallest number of inliers of a loop that alone gives a lost camera its place in the map.
  int relocalisation_inliers = 60;
  /// Largest squared Mahalanobis distance to the other loops and to the prediction; 22.458 is the 99.9 %
  /// quantile of chi-square with 6 degrees of freedom.
  double max_chi2 = 22.458;
  /// Factor on the covariances for max_chi2; 9 allows errors three times the standard deviation.
  double gate_scale = 1.0;
};

/// Optimisation over the keyframes' poses.
struct PoseGraphSettings {
  int max_iterations = 50;  ///< of the solver
  /// Squared Mahalanobis distance above which the robust loss reduces a loop's weight.
  double loop_scale = 22.458;
};

/// Loop closing, from recognition to correction.
struct LoopClosureSettings {
  bool enabled = true;
  double spacing_baselines = 18.6;  ///< smallest path length between two loops of the same revisit
};

/// What follows the camera.
enum class SystemKind {
  kSlam,      ///< landmarks relative to a keyframe, loops
  kPaper,     ///< the DQV-SLAM paper as published
  kOdometry,  ///< as kSlam, but the landmarks do not correct the pose: the odometry alone, as a baseline
};

struct Settings {
  std::string preset = "default";         ///< the preset that the other values started from
  SystemKind system = SystemKind::kSlam;  ///< that of the preset
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
