// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

/// Every number the SLAM can be told, with its default. Loaded from YAML by settings.cpp, which checks each
/// key.
namespace stereo_slam {

/// Preparation of the images.
struct ImageSettings {
  bool clahe = false;             ///< equalise the contrast locally (CLAHE): dark rooms, back light
  double clahe_clip_limit = 3.0;  ///< steepest slope of the grey-value curve
  int clahe_tiles = 8;            ///< a side of the image
};

/// Corner detection and description.
struct FeatureSettings {
  int count = 1000;           ///< ORB features an image
  int levels = 4;             ///< pyramid levels
  double scale_factor = 1.2;  ///< between levels
  int cell_px = 32;           ///< grid cell over which features are spread
  int fast_threshold = 6;     ///< grey levels; the grid picks the strongest
};

/// Disparity of single points.
struct StereoMatchingSettings {
  int max_disparity_px = 160;
  double min_disparity_px = 0.3;  ///< nearer to zero is taken for a wrong match
  double max_row_error_px = 1.0;  ///< epipolar check
  double uniqueness = 0.8;        ///< best cost over second best
  double min_correlation = 0.85;
};

/// Online estimate of what rectification has left over.
struct RectificationSettings {
  bool refine = true;
  double row_sigma_px = 2.0;        ///< prior spread of the row offset's coefficients
  double disparity_sigma_px = 0.7;  ///< prior spread of the disparity offset's coefficients
  double scale_sigma = 0.005;       ///< relative error of baseline times focal length, common to all lengths
  double principal_point_sigma_px = 0.5;  ///< error of the principal point, common to all frames
};

/// Frame-to-frame stereo odometry, the system input u_k.
struct OdometrySettings {
  int max_points = 300;
  double exclusion_px = 4.0;  ///< kept between the odometry's points and those of the filter
  int cell_px = 50;           ///< bucket over which the points are spread
  int window_px = 15;         ///< side of the flow window
  int pyramid_levels = 3;
  double max_loop_error_px = 1.0;  ///< circular matching: distance between start and end of the circle
  double max_row_error_px = 1.5;   ///< epipolar check
  int ransac_iterations = 200;
  int min_inliers = 12;
  double pixel_sigma_px = 0.4;  ///< standard deviation of a tracked coordinate
};

/// Noise v_k of the prediction (eq. 11): the odometry's own covariance, never below a floor.
struct MotionSettings {
  double covariance_scale = 1.0;  ///< factor on the odometry's covariance
  double min_rotation_sigma_rad = 2e-4;
  double min_translation_sigma_m = 2e-3;
  double lost_rotation_sigma_rad = 0.03;  ///< a frame without odometry
  double lost_translation_sigma_m = 0.5;
};

/// Data association (sec. IV-C).
struct AssociationSettings {
  double feature_sigma_px = 1.0;     ///< localisation noise of a detected corner
  int max_descriptor_distance = 64;  ///< bits, of 256
  double descriptor_ratio = 0.9;     ///< best over second best distance in the search region
  double max_row_error_px = 2.0;     ///< epipolar coherence
  int flow_window_px = 15;
  double flow_tolerance_px = 3.0;        ///< observed against predicted flow, absolute ...
  double flow_relative_tolerance = 0.2;  ///< ... and in parts of its length
};

/// Sub-pixel measurement of the reference keyframe's landmarks.
struct RefinementSettings {
  bool enabled = true;
  double min_correlation = 0.8;
  double max_shift_px = 3.0;      ///< from the associated feature or the flow
  double max_row_error_px = 1.0;  ///< epipolar coherence
  double pixel_sigma_px = 0.25;   ///< noise of an aligned coordinate
  double gate_sigma_px = 1.0;     ///< floor of the innovation gate
};

/// How the predicted pose is corrected by the landmarks.
enum class PoseUpdateMethod {
  kPaper,        ///< Alg. 2 with 7 x 7 points, orientation and translation independent, subsets
  kProgressive,  ///< Alg. 2 with degree-5 points and the coupling
  kQuadratic,    ///< exact steps of a quadratic model of the log-likelihood
  kNone,         ///< not at all: the odometry alone, as a baseline
};

/// Pose update (sec. III-B and IV-D).
struct UpdateSettings {
  PoseUpdateMethod method = PoseUpdateMethod::kQuadratic;
  double tau = 0.5;                      ///< smallest likelihood ratio within a progression step, below 1
  int max_correspondences = 30;          ///< a subset, for the paper's method
  double regularizer_sigma_m = 1e-3;     ///< added to the translation between the paper's subsets
  double regularizer_forgetting = 1e-3;  ///< relative widening of the orientation between the paper's subsets
  double robust_cap = 16.0;  ///< squared Mahalanobis distance beyond which a match counts no further
  int min_matches = 10;      ///< fewer leave the prediction as it is
};

/// Where the state is held (see docs/conventions.md).
enum class MapLayout {
  kGlobal,    ///< the paper's: one map in the first camera's frame, landmarks updated in every frame
  kAnchored,  ///< pose and landmarks relative to the last keyframe; absolute pose by composition
};

/// Landmarks (sec. IV-E).
struct MapSettings {
  MapLayout layout = MapLayout::kAnchored;
  int max_new_landmarks = 500;                   ///< a keyframe, or a frame of the global layout
  int cell_px = 40;                              ///< bucket over which they are spread
  double inverse_depth_beyond_baselines = 40.0;  ///< farther landmarks are held in inverse depth
  double max_baselines = 140.0;                  ///< farther landmarks are not used
  double pixel_sigma_px = 0.25;                  ///< noise of a new landmark's measurement
  bool update_landmarks = false;                 ///< Alg. 4 after every pose update
  bool track_correlation = true;  ///< of the pose's error with the landmarks'; not with update_landmarks
  int cull_after_frames = 5;      ///< landmarks unseen for longer are dropped
};

/// When the anchored layout takes a new reference.
struct KeyframeSettings {
  double min_match_ratio = 0.6;  ///< matched landmarks over the keyframe's
  int min_matches = 60;
  int max_frames = 20;  ///< since the last keyframe
};

/// Which earlier keyframes look like the present one.
struct PlaceRecognitionSettings {
  int trees = 4;                     ///< each splits descriptors by bits of its own
  int leaf_size = 48;                ///< descriptors in a leaf before it is split
  int max_descriptor_distance = 40;  ///< bits, of 256, between views of one point
  int min_gap_frames = 60;           ///< younger keyframes are the present, not a place seen again
  int candidates = 3;                ///< handed on for verification, at most
  double min_score = 0.01;      ///< of a candidate: share of the points that voted, rare ones counting more
  double view_radius_m = 10.0;  ///< keyframes as near are candidates by their place alone ...
  double min_share_in_view = 0.5;  ///< ... if as many of their points should be seen
};

/// Geometry of a loop candidate.
struct LoopVerificationSettings {
  int max_descriptor_distance = 64;        ///< bits, of 256
  double descriptor_ratio = 0.9;           ///< best over second best distance
  int ransac_iterations = 300;             ///< perspective three-point hypotheses
  double max_reprojection_error_px = 4.0;  ///< of an inlier of RANSAC
  double search_radius_px = 8.0;           ///< guided matching: from where a point is predicted
  double pixel_sigma_px = 1.0;             ///< localisation noise of a corner
  int min_inliers = 25;
  int consecutive = 3;           ///< keyframes in a row whose loops must agree
  double max_chi2 = 22.458;      ///< 99.9 % of six degrees of freedom: for loops in a row, and for the gate
  double gate_scale = 9.0;       ///< factor on the covariances in both: errors may be three times as they say
  double drift_m_per_m = 0.003;  ///< allowance for what the covariances do not know of: systematic errors
  double drift_rad_per_m = 1e-5;  ///< the same of the rotation
};

/// Optimisation over keyframes.
struct PoseGraphSettings {
  int max_iterations = 50;
  double loop_scale = 22.458;  ///< squared Mahalanobis distance beyond which a loop loses its say
};

/// Loops, from recognition to correction.
struct LoopClosureSettings {
  bool enabled = true;
  int max_points = 500;     ///< a keyframe keeps
  int latency_frames = 15;  ///< from a keyframe to the correction that its loop brings
};

struct Settings {
  std::string preset = "default";
  std::uint64_t seed = 1;
  ImageSettings images;
  FeatureSettings features;
  StereoMatchingSettings stereo;
  RectificationSettings rectification;
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
