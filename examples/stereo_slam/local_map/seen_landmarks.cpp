// SPDX-License-Identifier: MIT
#include "stereo_slam/local_map/seen_landmarks.hpp"

#include "stereo_slam/frontend/spatial_index.hpp"

namespace stereo_slam {

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
