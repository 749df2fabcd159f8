// SPDX-License-Identifier: MIT
#include "stereo_slam/frontend/stereo_points.hpp"

#include <algorithm>

#include "stereo_slam/frontend/spatial_index.hpp"
#include "stereo_slam/frontend/stereo_matching.hpp"

namespace stereo_slam {

StereoPoints measure_stereo_points(const StereoFrame& frame, const std::vector<Feature>& features,
                                   const std::vector<Vector2<double>>& reserved_px,
                                   const RectificationResidual& rectification, const Settings& settings) {
  auto free = exclude_features(features, reserved_px, frame.left.size(), settings.odometry.exclusion_px);
  std::stable_sort(free.begin(), free.end(), [](auto& a, auto& b) { return a.response > b.response; });
  std::vector<Vector2<double>> candidates;
  for (const auto& feature : free) candidates.push_back(feature.position_px);
  std::vector<Vector2<double>> chosen_px;
  std::vector<Descriptor> chosen_descriptors;
  for (const std::size_t i : spread_over_buckets(candidates, frame.left.size(), settings.map.cell_px,
                                                 static_cast<std::size_t>(settings.map.max_new_landmarks))) {
    chosen_px.push_back(candidates[i]);
    chosen_descriptors.push_back(free[i].descriptor);
  }
  const auto stereo = match_stereo(frame.left, frame.right, chosen_px, rectification, settings.stereo);
  StereoPoints points;
  for (std::size_t i = 0; i < stereo.size(); ++i) {
    if (!stereo[i]) continue;
    points.rows.push_back(*stereo[i]);
    points.measurements.push_back(stereo[i]->z);
    points.descriptors.push_back(chosen_descriptors[i]);
  }
  return points;
}

}  // namespace stereo_slam
