// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <vector>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/frontend/features.hpp"
#include "stereo_slam/frontend/online_rectification.hpp"
#include "stereo_slam/keyframes/keyframe_database.hpp"
#include "stereo_slam/local_map/landmark.hpp"
#include "stereo_slam/settings/settings.hpp"
#include "stereo_slam/tracking/update.hpp"

namespace stereo_slam {

/// The keyframe that pose and landmarks are relative to.
struct ReferenceKeyframe {
  Keyframe keyframe;          ///< its points; loops keep its pose
  cv::Mat left;               ///< its image
  std::size_t landmarks = 0;  ///< that it began with
};

/// A keyframe that the camera may have come back to: with its picture and the landmarks relative to it.
struct RecognisableKeyframe {
  const Keyframe& keyframe;
  const std::vector<Landmark>& landmarks;
  const cv::Mat& left;
};

/// T_keyframe_camera from the pictures alone: measured as a loop would be, and believed if the keyframe's
/// landmarks look as they should from there.
[[nodiscard]] std::optional<PoseDensity> recognise_keyframe(
    const RecognisableKeyframe& reference, const StereoFrame& frame, const StereoFeatures& features,
    const StereoCamera& camera, const RectificationResidual& rectification, const Settings& settings);

}  // namespace stereo_slam
