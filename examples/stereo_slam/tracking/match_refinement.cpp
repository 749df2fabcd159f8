// SPDX-License-Identifier: MIT
#include "stereo_slam/tracking/match_refinement.hpp"

#include <cmath>
#include <unordered_map>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "stereo_slam/frontend/patch_alignment.hpp"

namespace stereo_slam {
namespace {

constexpr double kChi2_3_99 = 11.345;

/// Warp of the patch from keyframe to current pixels, for a surface parallel to the keyframe's image plane.
[[nodiscard]] std::optional<Matrix2<double>> patch_warp(const Landmark& landmark,
                                                        const Pose& T_keyframe_camera,
                                                        const StereoCamera& camera) {
  constexpr double kStep_px = 5.0;
  Matrix2<double> warp;
  const StereoPoint anchor = project(to_point(landmark, landmark.mean, camera), Pose::identity(), camera)
                                 .value_or(StereoPoint::Zero());
  if (!(anchor.z() > 0.0)) return std::nullopt;
  const auto seen = [&](const Vector2<double>& offset) {
    const Vector3<double> z = anchor + Vector3<double>(offset.x(), offset.y(), 0.0);
    return camera.project(T_keyframe_camera.inverse() * camera.back_project(z));
  };
  for (int axis = 0; axis < 2; ++axis) {
    const Vector2<double> offset = kStep_px * Vector2<double>::Unit(axis);
    const auto ahead = seen(offset);
    const auto behind = seen(-offset);
    if (!ahead || !behind) return std::nullopt;
    warp.col(axis) = (*ahead - *behind).head<2>() / (2.0 * kStep_px);
  }
  if (!(std::abs(warp.determinant()) > 0.05)) return std::nullopt;
  return warp;
}

/// Sub-pixel stereo measurement of one landmark.
[[nodiscard]] std::optional<StereoPoint> measure(const Landmark& landmark, const PredictedLandmark& predicted,
                                                 const Vector2<double>& start_px,
                                                 const cv::Mat& keyframe_left, const StereoFrame& frame,
                                                 const Pose& T_keyframe_camera, const StereoCamera& camera,
                                                 const RectificationResidual& rectification,
                                                 const RefinementSettings& settings) {
  const auto warp = patch_warp(landmark, T_keyframe_camera, camera);
  if (!warp) return std::nullopt;
  const auto patch = PatchTemplate::extract(keyframe_left, landmark.anchor_px, warp->inverse());
  if (!patch) return std::nullopt;
  const auto left = patch->align(frame.left, start_px, settings.max_shift_px);
  if (!left || left->correlation < settings.min_correlation) return std::nullopt;
  const StereoPoint expected(left->position_px.x(), left->position_px.y(), predicted.z.z());
  const auto right = patch->align(frame.right, rectification.right_position(expected), settings.max_shift_px);
  if (!right || right->correlation < settings.min_correlation) return std::nullopt;
  const auto measured = rectification.measure(left->position_px, right->position_px);
  if (std::abs(measured.row_error_px) > settings.max_row_error_px || !(measured.z.z() > 0.0))
    return std::nullopt;
  return measured.z;
}

}  // namespace

std::vector<Match> refine_matches(const std::vector<Match>& matches,
                                  const std::vector<PredictedLandmark>& predicted,
                                  const std::vector<std::optional<Vector2<double>>>& flow,
                                  const std::vector<Landmark>& landmarks, const cv::Mat& keyframe_left,
                                  const StereoFrame& frame, const Pose& T_keyframe_camera,
                                  const StereoCamera& camera, const RectificationResidual& rectification,
                                  const RefinementSettings& settings) {
  std::unordered_map<std::size_t, const Match*> by_landmark;
  for (const auto& match : matches) by_landmark.emplace(match.landmark, &match);
  const Matrix3<double> R = stereo_pixel_covariance(settings.pixel_sigma_px);

  std::vector<std::optional<Match>> refined(predicted.size());
  cv::parallel_for_(cv::Range(0, static_cast<int>(predicted.size())), [&](const cv::Range& range) {
    for (auto i = static_cast<std::size_t>(range.start); i < static_cast<std::size_t>(range.end); ++i) {
      const PredictedLandmark& p = predicted[i];
      const auto associated = by_landmark.find(p.index);
      if (associated == by_landmark.end() && !flow[i]) continue;
      const Vector2<double> start = flow[i] ? *flow[i] : Vector2<double>(associated->second->z.head<2>());
      const auto z = measure(landmarks[p.index], p, start, keyframe_left, frame, T_keyframe_camera, camera,
                             rectification, settings);
      if (!z) continue;
      const Vector3<double> innovation = *z - p.z;
      const Matrix3<double> gate =
          p.landmark_part + p.pose_part + stereo_pixel_covariance(settings.gate_sigma_px);
      if (innovation.dot(gate.llt().solve(innovation)) > kChi2_3_99) continue;
      Match match{p.index, *z, R, p, std::nullopt};
      if (associated != by_landmark.end()) match.left_feature = associated->second->left_feature;
      refined[i] = match;
    }
  });
  std::vector<Match> result;
  for (auto& match : refined) {
    if (match) result.push_back(std::move(*match));
  }
  return result;
}

}  // namespace stereo_slam
