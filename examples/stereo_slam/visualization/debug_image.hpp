// SPDX-License-Identifier: MIT
#pragma once

#include <opencv2/core.hpp>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/tracking/associate.hpp"

namespace stereo_slam {

/// The paper's Fig. 4 for one frame (CV_8UC3): the left image with searched and found landmarks. A legend
/// below explains the colours and counts:
///   orange  predicted flow of a landmark, from the previous image to its predicted position
///   blue    observed flow
///   red     observed flow that the flow gate refused, as on moving objects
///   green   search ellipse of a landmark
///   yellow  match
///   white   points of the odometry
[[nodiscard]] cv::Mat draw_debug_image(const StereoFrame& frame, const FrameResult& result,
                                       const AssociationTrace& trace);

}  // namespace stereo_slam
