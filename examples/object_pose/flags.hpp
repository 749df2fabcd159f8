// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>

#include <opencv2/core.hpp>

#include "estimate.hpp"

/// Draws of pose densities, shown as flags: the foot is the position, the pole the z axis, and the pennant
/// points along the x axis (MPG sec. VI).
namespace object_pose {

/// The flags and the panels they are drawn in.
struct FlagSettings {
  int draws = 60;  ///< number of flags of a belief
  double pole_m = 0.11;
  double pennant_m = 0.07;
  int panel_px = 360;   ///< side of the square that shows the box
  double margin = 0.2;  ///< space around the box, as a share of its size in the image
};

/// The image that a stage is drawn on.
struct StageBackground {
  const cv::Mat1b& left;  ///< left image
  const StereoCamera& camera;
  const BoxSize& size_m;
  const std::optional<Pose>& ground_truth;  ///< outlined if known
  Pose view;                                ///< T_camera_object that decides which part of the image is shown
};

/// Draws a stage as two squares cut from the left image. In the first, the belief before is green, and the
/// object's pose given the feature alone is blue, with a dot at the feature. In the second, the belief after
/// is red, and more opaque where it is denser.
[[nodiscard]] cv::Mat3b draw_stage(const Stage& stage, const Match& match, const StageBackground& background,
                                   const FlagSettings& settings = {});

}  // namespace object_pose
