// SPDX-License-Identifier: MIT
#include "stereo_slam/tracking/landmark_search.hpp"

#include <utility>

#include "stereo_slam/core/median.hpp"
#include "stereo_slam/local_map/landmark_projection.hpp"
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

Association LandmarkSearch::predict(const PoseGaussian& T_keyframe_camera) const {
  Association association;
  association.predicted = project_landmarks(map_, T_keyframe_camera, settings_.map.max_baselines);
  return association;
}

void LandmarkSearch::observe(Association& association) const {
  association.flow = observe_flow(association.predicted, map_, T_keyframe_previous_, pyramids_, lens_);
  association.search_start_px =
      gate_by_flow(association.predicted, association.flow, lens_, settings_.association);
}

Association LandmarkSearch::align_patches(const PoseGaussian& T_keyframe_camera, const StereoView& view,
                                          bool motion_known, const ExpectedMotion& expected) const {
  Association association = predict(T_keyframe_camera);
  Pose pose = T_keyframe_camera.pose;
  if (motion_known && is_precise(association.predicted)) {
    for (const auto& landmark : association.predicted) {
      association.search_start_px.emplace_back(lens_.in_image(landmark.z.head<2>()));
    }
  } else {
    observe(association);
    const auto found = pose_by_flow(association.predicted, association.flow, map_, lens_);
    if (found && !expected.surprised_by(T_keyframe_previous_.inverse() * found->T_keyframe_camera)) {
      pose = found->T_keyframe_camera;
      for (std::size_t i = 0; i < found->agrees.size(); ++i) {
        association.search_start_px[i].reset();
        if (found->agrees[i]) association.search_start_px[i] = association.flow[i]->to_px;
      }
    }
  }
  auto aligned =
      align_landmarks(association, {map_.landmarks, keyframe_left_}, view, pose, settings_.refinement);
  association.matches = std::move(aligned.matches);
  association.right_image = aligned.right_image;
  return association;
}

Association LandmarkSearch::match_features(const PoseGaussian& T_keyframe_camera,
                                           const StereoFeatures& features) const {
  Association association = predict(T_keyframe_camera);
  observe(association);
  association.matches =
      associate(association.predicted, association.search_start_px, map_, features, settings_.association);
  return association;
}

}  // namespace stereo_slam
