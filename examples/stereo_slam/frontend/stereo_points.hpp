// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/frontend/features.hpp"
#include "stereo_slam/rig/stereo_measurement.hpp"
#include "stereo_slam/rig/stereo_view.hpp"
#include "stereo_slam/settings/settings.hpp"

namespace stereo_slam {

/// Features with a stereo match, from which landmarks and keyframes are created. Both lists have one entry
/// per point, but `descriptors` is empty if the points have none.
struct StereoPoints {
  std::vector<StereoMeasurement> measured;
  std::vector<Descriptor> descriptors{};
  /// Standard deviation, relative to all depths, of an error that they share: that of the motion and the
  /// lens, if the depths are not from a right image.
  double scale_sigma = 0.0;
};

/// The strongest features that are at least settings.odometry.exclusion_px from `reserved_px` and have a
/// stereo match, spread over buckets of settings.map.cell_px, at most settings.map.max_new_landmarks.
[[nodiscard]] StereoPoints measure_stereo_points(const StereoView& view, const std::vector<Feature>& features,
                                                 const std::vector<Vector2<double>>& reserved_px,
                                                 const Settings& settings);

/// Corners of a left image away from `present_px`, spread over buckets of settings.map.cell_px, at most
/// settings.map.max_new_landmarks together with these, px.
[[nodiscard]] std::vector<Vector2<double>> find_landmark_corners(
    const cv::Mat& left, const std::vector<Vector2<double>>& present_px, const Settings& settings);

/// Stereo measurements of corners detected in the whole left image, without descriptors: spread over buckets
/// of settings.map.cell_px, at most settings.map.max_new_landmarks.
[[nodiscard]] StereoPoints measure_stereo_corners(const StereoView& view, const Settings& settings);

}  // namespace stereo_slam
