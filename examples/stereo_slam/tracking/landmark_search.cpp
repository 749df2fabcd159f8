// SPDX-License-Identifier: MIT
#include "stereo_slam/tracking/landmark_search.hpp"

#include "stereo_slam/core/median.hpp"
#include "stereo_slam/tracking/pose_by_flow.hpp"

namespace stereo_slam {
namespace {

/// Whether the pose predicts the landmarks' positions to about a pixel, typically.
[[nodiscard]] bool is_precise(const std::vector<PredictedLandmark>& predicted) {
  constexpr double kPrecise_px = 1.5;
  std::vector<double> variance_px2;
  variance_px2.reserve(predicted.size());
  for (const auto& landmark : predicted) {
    variance_px2.push_back(landmark.pose_part.topLeftCorner<2, 2>().trace());
  }
  return median(variance_px2) <= kPrecise_px * kPrecise_px;
}

}  // namespace

void LandmarkSearch::observe(Association& association) const {
  association.flow = observe_flow(association.predicted, map, T_keyframe_previous, pyramids, lens);
  association.search_start_px =
      gate_by_flow(association.predicted, association.flow, lens, settings.association);
}

Association LandmarkSearch::align_patches(const PoseGaussian& T_keyframe_camera, const StereoView& view,
                                          bool right_fits, const ExpectedMotion& expected) const {
  Association association = expect_landmarks(map, T_keyframe_camera, lens, settings.map);
  Pose pose = T_keyframe_camera.pose;
  const bool by_prediction = right_fits && expected.known();
  if (!by_prediction && !is_precise(association.predicted)) {
    observe(association);
    const auto found = pose_by_flow(association.predicted, association.flow, map, lens);
    if (found && !expected.surprised_by(T_keyframe_previous.inverse() * found->T_keyframe_camera)) {
      pose = found->T_keyframe_camera;
      for (std::size_t i = 0; i < found->agrees.size(); ++i) {
        association.search_start_px[i].reset();
        if (found->agrees[i]) association.search_start_px[i] = association.flow[i]->to_px;
      }
    }
  }
  align_landmarks(association, {map.landmarks, keyframe_left}, view, pose, settings.refinement);
  return association;
}

Association LandmarkSearch::match_features(const PoseGaussian& T_keyframe_camera,
                                           const StereoFeatures& features) const {
  Association association = expect_landmarks(map, T_keyframe_camera, lens, settings.map);
  observe(association);
  association.matches =
      associate(association.predicted, association.search_start_px, map, features, settings.association);
  return association;
}

}  // namespace stereo_slam
