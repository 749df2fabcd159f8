// SPDX-License-Identifier: MIT
#pragma once

#include <optional>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/frontend/patch_alignment.hpp"
#include "stereo_slam/rig/late_exposure.hpp"

namespace stereo_slam {

/// A point and the plane around it, as one stereo camera sees them: the disparity is linear in the pixel.
struct StereoPlane {
  StereoPoint z;
  Vector2<double> disparity_slope = Vector2<double>::Zero();  ///< d disparity / d (u, v)
};

/// The same plane seen by a second camera, and the warps from there to the first left image.
struct PlaneView {
  StereoPlane plane;  ///< as the second camera sees it
  PatchWarp left;     ///< from the second left image (target) to the first left image (source)
  PatchWarp right;    ///< from the second right image (target) to the first left image (source)
};

/// View of a second camera on a plane that the first camera measured. Nothing if the plane's point is not
/// farther than StereoCamera::kMinDepth_m in front of the second camera, or the plane is seen edge-on.
[[nodiscard]] std::optional<PlaneView> view_plane(const StereoPlane& plane, const Pose& T_first_second,
                                                  const StereoCamera& camera);

/// Warp from the right image to the left image of the camera that sees the plane; nothing if it is edge-on.
[[nodiscard]] std::optional<PatchWarp> right_warp(const StereoPlane& plane,
                                                  const LateExposure& exposure = {});

}  // namespace stereo_slam
