// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/frontend/online_rectification.hpp"
#include "stereo_slam/local_map/landmark.hpp"
#include "stereo_slam/local_map/match.hpp"
#include "stereo_slam/settings/settings.hpp"

namespace stereo_slam {

/// Measures the landmarks of the reference keyframe to a fraction of a pixel.
///
/// The patch around a landmark in the keyframe, warped to the predicted view, is aligned in both images of
/// the current frame, starting from the feature associated with it or, without one, from its flow. Every
/// frame is compared with the same keyframe, so no drift accumulates, and landmarks whose corner was not
/// detected again still count. Kept are alignments that correlate, satisfy the epipolar constraint and agree
/// with the prediction.
[[nodiscard]] std::vector<Match> refine_matches(const std::vector<Match>& matches,
                                                const std::vector<PredictedLandmark>& predicted,
                                                const std::vector<std::optional<Vector2<double>>>& flow,
                                                const std::vector<Landmark>& landmarks,
                                                const cv::Mat& keyframe_left, const StereoFrame& frame,
                                                const Pose& T_keyframe_camera, const StereoCamera& camera,
                                                const RectificationResidual& rectification,
                                                const RefinementSettings& settings);

}  // namespace stereo_slam
