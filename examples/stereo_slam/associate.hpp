// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <vector>

#include "features.hpp"
#include "landmark_projection.hpp"
#include "optical_flow.hpp"
#include "settings.hpp"
#include "types.hpp"

namespace stereo_slam {

/// Landmark found in the current frame.
struct Match {
  std::size_t landmark = 0;     ///< index in the list of landmarks
  StereoPoint z;                ///< where it was seen
  Matrix3<double> R;            ///< pixel noise of z
  PredictedLandmark predicted;  ///< where it was expected
  std::optional<std::size_t>
      left_feature;  ///< matched feature of the left image, if descriptors made the match
};

/// Features of the current frame that are at least `radius_px` from `used_px` in the left image.
[[nodiscard]] std::vector<Feature> exclude_features(const std::vector<Feature>& features,
                                                    const std::vector<Vector2<double>>& used_px,
                                                    cv::Size image, double radius_px);

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
