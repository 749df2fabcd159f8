// SPDX-License-Identifier: MIT
#pragma once

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/frontend/features.hpp"
#include "stereo_slam/frontend/optical_flow.hpp"
#include "stereo_slam/odometry/expected_motion.hpp"
#include "stereo_slam/rig/stereo_view.hpp"
#include "stereo_slam/settings/settings.hpp"
#include "stereo_slam/tracking/associate.hpp"
#include "stereo_slam/tracking/landmark_alignment.hpp"

namespace stereo_slam {

/// Search for the landmarks of the local map in one frame: by aligning their patches, or by features as in
/// the paper. Refers to its arguments.
struct LandmarkSearch {
  const MapView& map;
  const cv::Mat& keyframe_left;
  const ConsecutivePyramids& pyramids;
  const Pose& T_keyframe_previous;  ///< the mean of the last posterior
  LensResidual lens;
  const Settings& settings;

  /// Aligns the patches of the keyframe's left image, starting where the landmarks are predicted at
  /// `T_keyframe_camera`. If this pose is uncertain by more than 1.5 px, the alignment starts where optical
  /// flow finds the landmarks, if most of them agree with one pose that is no surprise after the `expected`
  /// motion: only there. Not, however, if a motion is expected and the right image fits without a doubt: that
  /// the odometry found no motion means traffic then, and the flow is that of a vehicle.
  [[nodiscard]] Association align_patches(const PoseGaussian& T_keyframe_camera, const StereoView& view,
                                          bool right_fits, const ExpectedMotion& expected) const;

  /// Matches the landmarks whose flow is that of a static point with the features of both images (sec. IV-C).
  [[nodiscard]] Association match_features(const PoseGaussian& T_keyframe_camera,
                                           const StereoFeatures& features) const;

  /// Computes the optical flow, and replaces the association's `flow` and `search_start_px` by its results.
  void observe(Association& association) const;
};

}  // namespace stereo_slam
