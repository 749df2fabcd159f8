// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <vector>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/frontend/features.hpp"
#include "stereo_slam/frontend/optical_flow.hpp"

namespace stereo_slam {

/// What the next frame is tracked from.
struct PreviousFrame {
  StereoPyramid pyramids;
  StereoPyramid before;  ///< pyramids of the frame before it, whose memory the next frame takes
  cv::Mat right;         ///< right image
  Pose T_keyframe_camera = Pose::identity();
  std::size_t position = 0;                  ///< in the trajectory
  std::vector<StereoPoint> odometry_points;  ///< where circular matching starts
  std::vector<StereoPoint> static_points;    ///< landmarks matched in it: they do not move in the world

  /// Whether a frame has the same images, bit by bit, as a camera that hangs delivers them.
  [[nodiscard]] bool repeated_by(const StereoFrame& frame) const;

  /// Takes the images of the next frame.
  void replace_images(const StereoFrame& frame, StereoPyramid next);
};

/// A frame with what is extracted from its images once and used by all stages. Refers to the frame.
struct FrameImages {
  const StereoFrame& frame;
  StereoPyramid pyramids;
  StereoPyramid equalised;       ///< the pyramids, as bright as the previous frame's: for optical flow
  StereoFeatures features = {};  ///< of the whole images, if landmarks are matched by descriptors
};

[[nodiscard]] FrameImages prepare_images(const StereoFrame& frame, PyramidSides sides,
                                         PreviousFrame& previous);

}  // namespace stereo_slam
