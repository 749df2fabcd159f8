// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <opencv2/core.hpp>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/frontend/stereo_points.hpp"
#include "stereo_slam/local_map/landmark.hpp"
#include "stereo_slam/local_map/match.hpp"

namespace stereo_slam {

/// Landmarks matched in the current frame, by position in the left image. They tell which points of a new
/// keyframe continue a landmark.
class ReobservedLandmarks {
 public:
  ReobservedLandmarks() = default;
  ReobservedLandmarks(const std::vector<Match>& matches, const std::vector<Landmark>& landmarks);

  /// For each point the id of the nearest landmark, if there is one within 1.5 px. Each landmark goes to one
  /// point.
  [[nodiscard]] std::vector<std::optional<std::uint32_t>> ids_at(const StereoPoints& points,
                                                                 const cv::Size& image) const;

 private:
  std::vector<Vector2<double>> positions_px_;
  std::vector<std::uint32_t> ids_;
};

}  // namespace stereo_slam
