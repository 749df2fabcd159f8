// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/frontend/online_rectification.hpp"
#include "stereo_slam/keyframes/keyframe_database.hpp"
#include "stereo_slam/loop_closing/pose_graph.hpp"

namespace stereo_slam {

/// What a run knows at its end: enough to localise in its map, or to continue it.
struct SavedMap {
  StereoCamera camera;
  RectificationEstimate rectification;
  std::vector<Keyframe> keyframes;   ///< keyframes[id]
  std::vector<PoseGraphEdge> loops;  ///< accepted ones, between ids of keyframes
  std::vector<MapPoint> points;      ///< what map.ply holds
};

/// How much of everything a map has: what a run that goes on with it counts from.
struct MapExtent {
  std::size_t keyframes = 0;
  std::size_t segments = 0;
  std::size_t frames = 0;
  std::uint32_t landmarks = 0;  ///< the largest number of one
};

[[nodiscard]] MapExtent extent_of(const SavedMap& map);

/// What becomes of a map that a run starts with.
enum class MapUse {
  kLocalise,  ///< it stays as it is, and the run finds its place in it
  kContinue,  ///< the run's keyframes join it, and loops may move all of them
};

/// Throws std::invalid_argument with the first thing that no run can have left behind: camera without extent,
/// numbers that are not finite, positions beyond 1e9 m, poses off the Study quadric, matrices that are no
/// covariances, frames or ways that go back, segments or landmarks with numbers that they cannot have, edges
/// and landmarks without their keyframes, points outside the image.
///
/// Relative poses of loops and keyframes are edges of the pose graph: their covariances are positive
/// definite. Those of absolute poses need only be semidefinite.
void check(const SavedMap& map);

/// Throws std::invalid_argument for a map that was made with another camera: focal length, principal point
/// and baseline agree to a thousandth, the image's size exactly.
void check_camera_of(const SavedMap& map, const StereoCamera& camera);

}  // namespace stereo_slam
