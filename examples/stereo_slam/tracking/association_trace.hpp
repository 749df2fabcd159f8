// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <vector>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/local_map/landmark_projection.hpp"
#include "stereo_slam/settings/settings.hpp"
#include "stereo_slam/tracking/associate.hpp"

namespace stereo_slam {

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
