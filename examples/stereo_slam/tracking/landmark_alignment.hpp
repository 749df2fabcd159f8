// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/local_map/landmark.hpp"
#include "stereo_slam/rig/stereo_view.hpp"
#include "stereo_slam/settings/settings.hpp"
#include "stereo_slam/tracking/associate.hpp"

namespace stereo_slam {

/// The data of the reference keyframe that patches are taken from.
struct PatchSource {
  const std::vector<Landmark>& landmarks;
  const cv::Mat& left;  ///< its left image
};

/// Finds landmarks of the reference keyframe with sub-pixel measurements: the matches of the association, and
/// how well the right image fits.
///
/// The patch around a landmark in the keyframe is warped to look as from the camera at `T_keyframe_camera`,
/// and aligned in both images of `view`, starting at association.search_start_px. Every frame is compared
/// with the same keyframe, so no drift accumulates. Alignments that do not correlate, violate the epipolar
/// constraint or contradict the prediction are dropped.
///
/// If the right image is not usable, the left one alone is searched. The disparities of the matches are then
/// those predicted, with a standard deviation so large that they do not count.
void align_landmarks(Association& association, const PatchSource& source, const StereoView& view,
                     const Pose& T_keyframe_camera, const RefinementSettings& settings);

}  // namespace stereo_slam
