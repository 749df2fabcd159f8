// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/frontend/features.hpp"
#include "stereo_slam/frontend/online_rectification.hpp"
#include "stereo_slam/settings/settings.hpp"

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

}  // namespace stereo_slam
