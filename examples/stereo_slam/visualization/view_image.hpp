// SPDX-License-Identifier: MIT
#pragma once

#include <span>

#include <opencv2/core.hpp>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// Status of a frame, for drawing its position on the path.
struct PathMark {
  TrackingStatus status = TrackingStatus::kInitializing;
  bool is_keyframe = false;
};

/// What --view shows. The caller keeps the objects that are referred to.
struct ViewScene {
  const StereoCamera& camera;
  const StereoFrame& frame;
  const FrameResult& result;              ///< of this frame
  std::span<const LandmarkTrack> tracks;  ///< landmarks in view
  std::span<const PoseGaussian> path;     ///< T_world_camera of every frame so far, this one last
  std::span<const PathMark> marks;        ///< of the same frames
  std::span<const MapPoint> map;          ///< of earlier keyframes
  std::span<const LoopEvent> loops;
};

/// Colour of a point at this depth, from red at five baselines to blue at a hundred.
[[nodiscard]] cv::Scalar depth_colour(double depth_m, double baseline_m);

/// The left image with the tracks, 900 to 1280 px wide, and beside it the map from above (CV_8UC3). Tracks
/// are filled where the landmark was found in this frame and hollow where it was only expected, coloured by
/// depth, and larger the more often the landmark was found.
[[nodiscard]] cv::Mat draw_view(const ViewScene& scene);

/// The path, coloured by status, with keyframes, accepted loops, map points and current landmarks, and the
/// camera with the 95 % ellipse of its position: a square image, x of the world to the right, z up, fitted to
/// the path. An ellipse that would be too small to be seen is enlarged, by the factor in its caption.
[[nodiscard]] cv::Mat draw_top_view(const ViewScene& scene, int side_px);

}  // namespace stereo_slam
