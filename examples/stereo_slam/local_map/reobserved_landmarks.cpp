// SPDX-License-Identifier: MIT
#include "stereo_slam/local_map/reobserved_landmarks.hpp"

#include "stereo_slam/frontend/spatial_index.hpp"

namespace stereo_slam {

ReobservedLandmarks::ReobservedLandmarks(const std::vector<Match>& matches,
                                         const std::vector<Landmark>& landmarks) {
  for (const auto& match : matches) {
    positions_px_.push_back(match.left_px);
    ids_.push_back(landmarks[match.landmark].id);
  }
}

std::vector<std::optional<std::uint32_t>> ReobservedLandmarks::ids_at(const StereoPoints& points,
                                                                      const cv::Size& image) const {
  constexpr double kSamePoint_px = 1.5;
  const SpatialIndex index(positions_px_, image);
  std::vector<bool> taken(ids_.size());
  std::vector<std::optional<std::uint32_t>> result;
  for (const auto& measured : points.measured) {
    const Vector2<double>& px = measured.left_px;
    std::optional<std::size_t> nearest;
    const auto distance = [&](std::size_t i) { return (positions_px_[i] - px).norm(); };
    index.for_each_in_box(px, Vector2<double>::Constant(kSamePoint_px), [&](std::size_t i) {
      if (!taken[i] && (!nearest || distance(i) < distance(*nearest))) nearest = i;
    });
    if (nearest) taken[*nearest] = true;
    result.push_back(nearest ? std::optional(ids_[*nearest]) : std::nullopt);
  }
  return result;
}

}  // namespace stereo_slam
