// SPDX-License-Identifier: MIT
#include "stereo_slam/tracking/association_trace.hpp"

#include <unordered_map>

namespace stereo_slam {

AssociationTrace trace_association(const std::vector<PredictedLandmark>& predicted,
                                   const std::vector<std::optional<LandmarkFlow>>& observed,
                                   const std::vector<std::optional<Vector2<double>>>& flow,
                                   const std::vector<Match>& matches,
                                   const std::vector<Vector2<double>>& odometry_px,
                                   const AssociationSettings& settings) {
  std::unordered_map<std::size_t, Vector2<double>> matched_px;  // by landmark
  for (const auto& match : matches) matched_px.emplace(match.landmark, match.z.head<2>());

  AssociationTrace trace;
  trace.odometry_px = odometry_px;
  for (std::size_t i = 0; i < predicted.size(); ++i) {
    TracedLandmark landmark;
    landmark.predicted_px = predicted[i].z.head<2>();
    landmark.flow = observed[i];
    landmark.static_flow = flow[i].has_value();
    landmark.search_covariance_px2 = innovation_covariance(predicted[i], settings).topLeftCorner<2, 2>();
    const auto match = matched_px.find(predicted[i].index);
    if (match != matched_px.end()) landmark.matched_px = match->second;
    trace.landmarks.push_back(landmark);
  }
  return trace;
}

}  // namespace stereo_slam
