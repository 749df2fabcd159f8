// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <vector>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/loop_closing/keyframe.hpp"
#include "stereo_slam/loop_closing/pose_graph.hpp"
#include "stereo_slam/rig/rectification_estimator.hpp"

namespace stereo_slam {

/// Map of a run, from which another run can localise in it or continue it.
struct SavedMap {
  StereoCamera camera;
  RectificationEstimate rectification;
  std::vector<Keyframe> keyframes;   ///< keyframes[id]
  std::vector<PoseGraphEdge> loops;  ///< accepted ones, between ids of keyframes
  std::vector<MapPoint> points;      ///< landmarks, as in map.ply
};

/// How a run uses the map that it starts with.
enum class MapUse {
  kLocalise,  ///< the map stays fixed, and the run is localised in it
  kContinue,  ///< the run extends the map, and loops may correct all of it
};

/// Throws std::invalid_argument for the first value that no run can have saved: a camera without image,
/// values that are not finite, positions beyond 1e9 m, poses off the Study quadric, matrices that are not
/// covariances, frames or path lengths that decrease, invalid ids of segments, landmarks or keyframes, and
/// points outside the image.
///
/// The relative poses of keyframes and loops are edges of the pose graph: their covariances have to be
/// positive definite. Those of absolute poses may be semidefinite.
void check(const SavedMap& map);

/// Throws std::invalid_argument unless the map was made with the same camera: focal length, principal point
/// and baseline agree to a thousandth, the image's size exactly.
void check_camera_of(const SavedMap& map, const StereoCamera& camera);

}  // namespace stereo_slam
