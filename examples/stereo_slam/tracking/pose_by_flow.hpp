// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/local_map/landmark.hpp"
#include "stereo_slam/rig/lens_residual.hpp"
#include "stereo_slam/tracking/associate.hpp"

namespace stereo_slam {

/// A rough pose by landmarks, and which of them agree with it.
struct FlowPose {
  Pose T_keyframe_camera;
  std::vector<std::uint8_t> agrees;  ///< one flag per predicted landmark
};

/// The pose with which most landmarks are where optical flow found them in the left image: RANSAC. Nothing if
/// fewer than twelve landmarks agree with the best pose, or fewer than a third of those that have a flow.
[[nodiscard]] std::optional<FlowPose> pose_by_flow(const std::vector<PredictedLandmark>& predicted,
                                                   const std::vector<std::optional<LandmarkFlow>>& flow,
                                                   const MapView& map, const LensResidual& lens);

}  // namespace stereo_slam
