// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <vector>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/local_map/landmark_projection.hpp"
#include "stereo_slam/settings/settings.hpp"
#include "stereo_slam/tracking/associate.hpp"

namespace stereo_slam {

/// What became of one landmark that should be in view. All positions are in the left image.
struct TracedLandmark {
  Vector2<double> predicted_px;
  std::optional<LandmarkFlow> flow;       ///< absent when it could not be followed from the previous image
  bool static_flow = false;               ///< passed the flow gate
  Matrix2<double> search_covariance_px2;  ///< its 99 % ellipse is searched for features
  std::optional<Vector2<double>> matched_px;
};

/// How the landmarks of one frame were looked for: the paper's Fig. 4 in numbers.
struct AssociationTrace {
  std::vector<TracedLandmark> landmarks;
  std::vector<Vector2<double>> odometry_px;  ///< points that the odometry rests on
};

/// `observed`, `flow` are as long as `predicted`: the flow of each before and after the gate.
[[nodiscard]] AssociationTrace trace_association(const std::vector<PredictedLandmark>& predicted,
                                                 const std::vector<std::optional<LandmarkFlow>>& observed,
                                                 const std::vector<std::optional<Vector2<double>>>& flow,
                                                 const std::vector<Match>& matches,
                                                 const std::vector<Vector2<double>>& odometry_px,
                                                 const AssociationSettings& settings);

}  // namespace stereo_slam
