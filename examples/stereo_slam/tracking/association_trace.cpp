// SPDX-License-Identifier: MIT
#include "stereo_slam/tracking/association_trace.hpp"

#include <unordered_map>

namespace stereo_slam {

AssociationTrace trace_association(const Association& association,
                                   const std::vector<Vector2<double>>& odometry_px,
                                   const AssociationSettings& settings) {
  std::unordered_map<std::size_t, Vector2<double>> matched_px;  // by landmark
  for (const auto& match : association.matches) matched_px.emplace(match.landmark, match.left_px);

  AssociationTrace trace;
  trace.odometry_px = odometry_px;
  for (std::size_t i = 0; i < association.predicted.size(); ++i) {
    TracedLandmark landmark;
    const PredictedLandmark& predicted = association.predicted[i];
    landmark.predicted_px = predicted.z.head<2>();
    landmark.flow = association.flow[i];
    landmark.static_flow = association.search_start_px[i].has_value();
    landmark.search_covariance_px2 = innovation_covariance(predicted, settings).topLeftCorner<2, 2>();
    const auto match = matched_px.find(predicted.index);
    if (match != matched_px.end()) landmark.matched_px = match->second;
    trace.landmarks.push_back(landmark);
  }
  return trace;
}

}  // namespace stereo_slam
