// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>

#include <opencv2/core.hpp>

#include "estimate.hpp"

/// Densities of poses as flags: the foot is the position, the pole the z axis, the tip of the pennant points
/// along the x axis. MPG sec. VI.
namespace object_pose {

struct FlagSettings {
  int draws = 60;  ///< flags of a belief
  double pole_m = 0.11;
  double pennant_m = 0.07;
  int panel_px = 360;   ///< side of the square that shows the box
  double margin = 0.2;  ///< around the box, as a share of its size
};

/// What a stage is drawn on.
struct StageBackground {
  const cv::Mat1b& left;  ///< image
  const StereoCamera& camera;
  const BoxSize& size_m;
  const std::optional<Pose>& ground_truth;  ///< outlined if known
  Pose view;                                ///< of the box: decides which part of the image is shown
};

/// A stage as two squares cut from the left image: the belief before (green) and the poses of the feature
/// (blue, its place a dot); and the belief after (red, opaque where it is dense).
[[nodiscard]] cv::Mat3b draw_stage(const Stage& stage, const Match& match, const StageBackground& background,
                                   const FlagSettings& settings = {});

}  // namespace object_pose
