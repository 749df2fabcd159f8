// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <vector>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/frontend/online_rectification.hpp"
#include "stereo_slam/frontend/stereo_view.hpp"
#include "stereo_slam/settings/settings.hpp"

namespace stereo_slam {

/// Finds the points of the left image in the right one, on their row, with sub-pixel disparity.
///
/// The smallest sum of absolute differences over the row is refined by aligning the patch; a point without
/// texture, with two similar candidates, or whose alignment leaves the row is not matched. One entry a point,
/// in order.
[[nodiscard]] std::vector<std::optional<RectificationResidual::Measurement>> match_stereo(
    const StereoView& view, const std::vector<Vector2<double>>& points_px,
    const StereoMatchingSettings& settings);

}  // namespace stereo_slam
