// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/frontend/repetition.hpp"
#include "stereo_slam/frontend/stereo_points.hpp"
#include "stereo_slam/loop_closing/keyframe.hpp"
#include "stereo_slam/rig/stereo_view.hpp"
#include "stereo_slam/settings/settings.hpp"
#include "stereo_slam/tracking/landmark_alignment.hpp"
#include "stereo_slam/tracking/motion_stereo.hpp"
#include "stereo_slam/tracking/update.hpp"

namespace stereo_slam {

/// The keyframe that pose and landmarks are relative to.
struct ReferenceKeyframe {
  Keyframe keyframe;           ///< points and pose, as loop closure got them
  cv::Mat left;                ///< left image
  std::size_t landmarks = 0;   ///< number of landmarks when the keyframe was created
  SceneRepetition scene;       ///< whether such images are ambiguous
  MotionStereo motion_stereo;  ///< corners whose depths the motion will tell, if its right image is not used
  /// Standard deviation, relative to their depths, of an error that all landmarks share because their depths
  /// are from the motion of the left camera; zero if they are from a right image.
  double scale_sigma = 0.0;

  /// Whether the depths of its landmarks are those of right images, or nearly so: after a few frames without
  /// one they still predict disparities.
  [[nodiscard]] bool has_stereo_depths() const {
    constexpr double kNearly = 0.01;  // half a pixel of a disparity of 50 px
    return scale_sigma < kNearly;
  }
  /// Whether there is one: the map has begun.
  [[nodiscard]] bool begun() const { return !left.empty(); }
  /// Whether the image shows one pattern many times, asked in this frame.
  [[nodiscard]] bool is_ambiguous(std::size_t frame) {
    return scene.repeats_itself(left, keyframe.frame, frame);
  }
};

/// T_keyframe_camera from the images and their `points` alone, without a prior; nothing if the keyframe is
/// not recognised. A rough pose is measured like a loop. The landmarks of the keyframe are aligned where this
/// pose predicts them, and correct it. This is repeated from the corrected pose, up to three times in all,
/// until a third of the landmarks that should be in view agree with it. Nothing if they never do, or if too
/// few are found to correct the pose.
[[nodiscard]] std::optional<PoseGaussian> recognise_keyframe(const Keyframe& keyframe,
                                                             const PatchSource& source,
                                                             const StereoView& view,
                                                             const StereoPoints& points,
                                                             const Settings& settings);

}  // namespace stereo_slam
