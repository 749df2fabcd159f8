// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <opencv2/core.hpp>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/local_map/landmark.hpp"
#include "stereo_slam/local_map/match.hpp"

namespace stereo_slam {

/// Where landmarks are in the current left image.
class SeenLandmarks {
 public:
  SeenLandmarks() = default;
  SeenLandmarks(const std::vector<Match>& matches, const std::vector<Landmark>& landmarks);

  /// The number of the landmark at each measurement, if there is one; each goes to one measurement.
  [[nodiscard]] std::vector<std::optional<std::uint32_t>> at(const std::vector<StereoPoint>& measurements,
                                                             const cv::Size& image) const;

 private:
  std::vector<Vector2<double>> positions_px_;
  std::vector<std::uint32_t> ids_;
};

}  // namespace stereo_slam
