// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <vector>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/frontend/features.hpp"
#include "stereo_slam/frontend/optical_flow.hpp"
#include "stereo_slam/local_map/landmark_projection.hpp"
#include "stereo_slam/local_map/match.hpp"
#include "stereo_slam/settings/settings.hpp"

namespace stereo_slam {

/// How the picture of a landmark moved from the previous left image to the current one.
struct LandmarkFlow {
  Vector2<double> from_px;  ///< its projection into the previous image
  Vector2<double> to_px;    ///< where the flow led
};

/// Observed flow of each predicted landmark; nothing where it could not be followed. `T_reference_previous`
/// is the last posterior.
[[nodiscard]] std::vector<std::optional<LandmarkFlow>> observe_flow(
    const std::vector<PredictedLandmark>& predicted, const std::vector<Landmark>& landmarks,
    const Pose& T_reference_previous, const StereoCamera& camera, const FlowPyramid& previous,
    const FlowPyramid& current, int window_px);

/// End, in the current left image, of each flow that agrees with the predicted one in length and direction;
/// nothing where it does not, as on moving objects (sec. IV-C, Fig. 4 a).
[[nodiscard]] std::vector<std::optional<Vector2<double>>> gate_by_flow(
    const std::vector<PredictedLandmark>& predicted, const std::vector<std::optional<LandmarkFlow>>& observed,
    const AssociationSettings& settings);

inline constexpr double kChi2_2_99 = 9.210;  ///< bounds the ellipse in which a feature is searched

/// S of the search for a landmark's feature: of the landmark, the pose and a detected corner.
[[nodiscard]] Matrix3<double> innovation_covariance(const PredictedLandmark& predicted,
                                                    const AssociationSettings& settings);

/// Pairs landmarks that passed the flow gate with features of both images by Mahalanobis and descriptor
/// distance, and keeps the pairs that satisfy the epipolar constraint (sec. IV-C). A left feature serves one
/// landmark.
[[nodiscard]] std::vector<Match> associate(const std::vector<PredictedLandmark>& predicted,
                                           const std::vector<Landmark>& landmarks,
                                           const std::vector<std::optional<Vector2<double>>>& flow,
                                           const StereoFeatures& features, cv::Size image,
                                           const AssociationSettings& settings);

}  // namespace stereo_slam
