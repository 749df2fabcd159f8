// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "camera/stereo_camera.hpp"
#include "keyframe_database.hpp"
#include "pose_graph.hpp"
#include "rectification.hpp"
#include "types.hpp"

namespace stereo_slam {

/// What a run knows at its end: enough to localise in its map, or to continue it.
struct SavedMap {
  StereoCamera camera;
  RectificationEstimate rectification;
  std::vector<Keyframe> keyframes;   ///< keyframes[id]
  std::vector<PoseGraphEdge> loops;  ///< accepted ones, between ids of keyframes
  std::vector<MapPoint> points;      ///< what map.ply holds
};

/// What becomes of a map that a run starts with.
enum class MapUse {
  kLocalise,  ///< it stays as it is, and the run finds its place in it
  kContinue,  ///< the run's keyframes join it, and loops may move all of them
};

/// Throws std::invalid_argument with the first thing that no run can have left behind: camera without extent,
/// numbers that are not finite, positions beyond 1e9 m, poses off the Study quadric, matrices that are no
/// covariances, frames or ways that go back, edges without their keyframes, points outside the image.
///
/// Relative poses of loops and of keyframes in one segment are edges of the pose graph: their covariances are
/// positive definite. Those of absolute poses, and of a segment's first keyframe, need only be semidefinite.
void check(const SavedMap& map);

}  // namespace stereo_slam
