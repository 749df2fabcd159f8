// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <vector>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/frontend/features.hpp"
#include "stereo_slam/frontend/optical_flow.hpp"
#include "stereo_slam/local_map/landmark.hpp"
#include "stereo_slam/local_map/match.hpp"
#include "stereo_slam/rig/lens_residual.hpp"
#include "stereo_slam/rig/right_image_fit.hpp"
#include "stereo_slam/settings/settings.hpp"

namespace stereo_slam {

/// Motion of a landmark from the previous left image to the current one.
struct LandmarkFlow {
  Vector2<double> from_px;  ///< its projection into the previous image
  Vector2<double> to_px;    ///< where optical flow finds it
};

/// Data association of one frame (sec. IV-C). The first three lists have one entry per predicted landmark.
struct Association {
  std::vector<PredictedLandmark> predicted;       ///< landmarks expected in view
  std::vector<std::optional<LandmarkFlow>> flow;  ///< nothing where the flow was lost; empty if not computed
  std::vector<std::optional<Vector2<double>>>
      search_start_px;  ///< where the left image is searched; nothing: the landmark's flow failed the gate
  std::vector<Match> matches;  ///< ordered by index of the landmark
  RightImageFit right_image;   ///< without points unless patches were aligned in both images
};

/// The landmarks that should be in view at `T_keyframe_camera`, to be searched where they are predicted.
[[nodiscard]] Association expect_landmarks(const MapView& map, const PoseGaussian& T_keyframe_camera,
                                           const LensResidual& lens, const MapSettings& settings);

/// Observed flow of each predicted landmark; nothing if the flow was lost. `T_keyframe_previous` is the mean
/// of the last posterior.
[[nodiscard]] std::vector<std::optional<LandmarkFlow>> observe_flow(
    const std::vector<PredictedLandmark>& predicted, const MapView& map, const Pose& T_keyframe_previous,
    const ConsecutivePyramids& pyramids, const LensResidual& lens);

/// End, in the current left image, of each flow that agrees with the predicted one in length and direction.
/// Nothing for flows that do not agree, such as those of moving objects (sec. IV-C, Fig. 4 a).
[[nodiscard]] std::vector<std::optional<Vector2<double>>> gate_by_flow(
    const std::vector<PredictedLandmark>& predicted, const std::vector<std::optional<LandmarkFlow>>& flow,
    const LensResidual& lens, const AssociationSettings& settings);

/// Covariance S of the innovation of a detected feature, px^2: landmark, pose and feature noise.
[[nodiscard]] Matrix3<double> innovation_covariance(const PredictedLandmark& predicted,
                                                    const AssociationSettings& settings);

/// Matches landmarks that passed the flow gate with features of both images, by Mahalanobis and descriptor
/// distance and the epipolar constraint (sec. IV-C). Each left feature goes to one landmark, the most
/// similar. `search_start_px` has one entry per predicted landmark.
[[nodiscard]] std::vector<Match> associate(const std::vector<PredictedLandmark>& predicted,
                                           const std::vector<std::optional<Vector2<double>>>& search_start_px,
                                           const MapView& map, const StereoFeatures& features,
                                           const AssociationSettings& settings);

/// Data association of one landmark that should be in view. All positions are in the left image.
struct TracedLandmark {
  Vector2<double> predicted_px;
  std::optional<LandmarkFlow> flow;       ///< nothing if it was lost
  bool static_flow = false;               ///< the flow passed the gate
  Matrix2<double> search_covariance_px2;  ///< features are searched in its 99 % ellipse
  std::optional<Vector2<double>> matched_px;
};

/// Data association of one frame, for debug images like the paper's Fig. 4.
struct AssociationTrace {
  std::vector<TracedLandmark> landmarks;
  std::vector<Vector2<double>> odometry_px;  ///< inliers of the odometry
};

/// The trace of an association and of the points that the odometry used in the same frame.
[[nodiscard]] AssociationTrace trace_association(const Association& association,
                                                 const std::vector<Vector2<double>>& odometry_px,
                                                 const AssociationSettings& settings);

}  // namespace stereo_slam
