// SPDX-License-Identifier: MIT
#include "stereo_points.hpp"

#include <algorithm>

#include "spatial_index.hpp"
#include "stereo_matching.hpp"

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

std::vector<KeyframePoint> keyframe_points(const StereoPoints& points,
                                           const std::vector<std::uint32_t>& landmarks) {
  std::vector<KeyframePoint> result;
  for (std::size_t i = 0; i < points.measurements.size(); ++i) {
    result.push_back(
        {points.measurements[i].cast<float>(), points.descriptors[i], landmarks.empty() ? 0 : landmarks[i]});
  }
  return result;
}

SeenLandmarks::SeenLandmarks(const std::vector<Match>& matches, const std::vector<Landmark>& landmarks) {
  for (const auto& match : matches) {
    positions_px_.push_back(match.z.head<2>());
    ids_.push_back(landmarks[match.landmark].id);
  }
}

std::vector<std::optional<std::uint32_t>> SeenLandmarks::at(const std::vector<StereoPoint>& measurements,
                                                            const cv::Size& image) const {
  constexpr double kSamePoint_px = 1.5;
  const SpatialIndex index(positions_px_, image);
  std::vector<bool> taken(ids_.size());
  std::vector<std::optional<std::uint32_t>> result;
  for (const auto& z : measurements) {
    std::optional<std::size_t> nearest;
    const auto distance = [&](std::size_t i) { return (positions_px_[i] - z.head<2>()).norm(); };
    index.for_each_in_box(z.head<2>(), Vector2<double>::Constant(kSamePoint_px), [&](std::size_t i) {
      if (!taken[i] && (!nearest || distance(i) < distance(*nearest))) nearest = i;
    });
    if (nearest) taken[*nearest] = true;
    result.push_back(nearest ? std::optional(ids_[*nearest]) : std::nullopt);
  }
  return result;
}

}  // namespace stereo_slam
