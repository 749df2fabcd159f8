// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <vector>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/rig/stereo_measurement.hpp"
#include "stereo_slam/rig/stereo_view.hpp"
#include "stereo_slam/settings/settings.hpp"

namespace stereo_slam {

/// Stereo matches of points of the left image, with sub-pixel disparity; one entry per point.
///
/// The search along the row minimises the sum of absolute differences; patch alignment refines the best
/// disparity. A point without texture, with two similar candidates, or whose alignment leaves the row has no
/// match.
[[nodiscard]] std::vector<std::optional<StereoMeasurement>> match_stereo(
    const StereoView& view, const std::vector<Vector2<double>>& points_px,
    const StereoMatchingSettings& settings);

}  // namespace stereo_slam
