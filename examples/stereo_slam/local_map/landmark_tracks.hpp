// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <vector>

#include "stereo_slam/core/landmark_track.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/local_map/landmark.hpp"

namespace stereo_slam {

/// The landmarks that are in view of the left and the right image at a pose, and whether they were found in
/// `frame`, the last one.
[[nodiscard]] std::vector<LandmarkTrack> tracks_in_view(const MapView& map, const Pose& T_keyframe_camera,
                                                        std::size_t frame);

}  // namespace stereo_slam
