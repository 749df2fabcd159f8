// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// ORB descriptors of points of a grey image, one per point, at full resolution and along the orientation of
/// the patch (Rublee et al. 2011). Descriptors of points nearer than kDescriptorReach_px to the border are
/// zero.
[[nodiscard]] std::vector<Descriptor> describe_points(const cv::Mat& image,
                                                      const std::vector<Vector2<double>>& points_px);

}  // namespace stereo_slam
