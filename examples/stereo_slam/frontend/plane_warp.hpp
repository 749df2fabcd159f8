// SPDX-License-Identifier: MIT
#pragma once

#include <optional>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/frontend/patch_alignment.hpp"

namespace stereo_slam {

/// A point and the plane around it, as one stereo camera sees them: the disparity is linear in the pixel.
struct StereoPlane {
  StereoPoint z;
  Vector2<double> disparity_slope = Vector2<double>::Zero();  ///< d disparity / d (u, v)
};

/// The same plane seen by a second camera, and how its pixels there correspond to those of the first left
/// image.
struct PlaneView {
  StereoPlane plane;
  PatchWarp left;   ///< from the second left image
  PatchWarp right;  ///< from the second right image
};

/// Nothing if the plane's point is not in front of the second camera, as StereoCamera::project() has it, or
/// the plane is seen edge-on.
[[nodiscard]] std::optional<PlaneView> view_plane(const StereoPlane& plane, const Pose& T_first_second,
                                                  const StereoCamera& camera);

/// Warp from the right image to the left image of the camera that sees the plane; nothing if it is edge-on.
[[nodiscard]] std::optional<PatchWarp> right_warp(const Vector2<double>& disparity_slope);

}  // namespace stereo_slam
