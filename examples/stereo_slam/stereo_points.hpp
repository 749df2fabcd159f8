// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "associate.hpp"
#include "keyframe_database.hpp"
#include "landmark.hpp"
#include "rectification.hpp"
#include "settings.hpp"
#include "types.hpp"

namespace stereo_slam {

/// What new landmarks and keyframes are made from: features spread over the picture that have a stereo match.
struct StereoPoints {
  std::vector<RectificationResidual::Measurement> rows;
  std::vector<StereoPoint> measurements;
  std::vector<Descriptor> descriptors;
};

/// Measures the strongest of the features that are away from `reserved_px`, spread over buckets
/// (settings.map), at most settings.map.max_new_landmarks.
[[nodiscard]] StereoPoints measure_stereo_points(const StereoFrame& frame,
                                                 const std::vector<Feature>& features,
                                                 const std::vector<Vector2<double>>& reserved_px,
                                                 const RectificationResidual& rectification,
                                                 const Settings& settings);

/// The same for a keyframe, with the numbers of their landmarks; without, all have number 0.
[[nodiscard]] std::vector<KeyframePoint> keyframe_points(const StereoPoints& points,
                                                         const std::vector<std::uint32_t>& landmarks);

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
