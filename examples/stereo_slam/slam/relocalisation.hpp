// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/frontend/features.hpp"
#include "stereo_slam/frontend/stereo_view.hpp"
#include "stereo_slam/keyframes/keyframe_database.hpp"
#include "stereo_slam/settings/settings.hpp"
#include "stereo_slam/tracking/match_refinement.hpp"
#include "stereo_slam/tracking/update.hpp"

namespace stereo_slam {

/// The keyframe that pose and landmarks are relative to.
struct ReferenceKeyframe {
  Keyframe keyframe;          ///< its points; loops keep its pose
  cv::Mat left;               ///< its image
  std::size_t landmarks = 0;  ///< that it began with
};

/// T_keyframe_camera from the images alone: measured as a loop is, and accepted if enough of the keyframe's
/// landmarks look as they should from there.
[[nodiscard]] std::optional<PoseDensity> recognise_keyframe(const Keyframe& keyframe,
                                                            const PatchSource& source, const StereoView& view,
                                                            const StereoFeatures& features,
                                                            const Settings& settings);

}  // namespace stereo_slam
