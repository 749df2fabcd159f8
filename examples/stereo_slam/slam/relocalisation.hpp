// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/frontend/stereo_points.hpp"
#include "stereo_slam/frontend/stereo_view.hpp"
#include "stereo_slam/keyframes/keyframe_database.hpp"
#include "stereo_slam/settings/settings.hpp"
#include "stereo_slam/tracking/match_refinement.hpp"
#include "stereo_slam/tracking/update.hpp"

namespace stereo_slam {

/// The keyframe that pose and landmarks are relative to.
struct ReferenceKeyframe {
  Keyframe keyframe;            ///< points, and what loop closure was given
  cv::Mat left;                 ///< left image
  std::size_t landmarks = 0;    ///< number of landmarks when the keyframe was created
  bool repeats_itself = false;  ///< so does its image: the camera may be elsewhere
};

/// T_keyframe_camera from the images and their `points` alone, without a prior. It is measured as a loop is,
/// and accepted if enough of the keyframe's landmarks are found where it predicts them.
[[nodiscard]] std::optional<PoseDensity> recognise_keyframe(const Keyframe& keyframe,
                                                            const PatchSource& source, const StereoView& view,
                                                            const StereoPoints& points,
                                                            const Settings& settings);

}  // namespace stereo_slam
