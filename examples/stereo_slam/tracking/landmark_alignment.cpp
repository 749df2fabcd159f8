// SPDX-License-Identifier: MIT
#include "stereo_slam/tracking/landmark_alignment.hpp"

#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "stereo_slam/core/chi_square.hpp"
#include "stereo_slam/frontend/patch_alignment.hpp"
#include "stereo_slam/frontend/plane_warp.hpp"

namespace stereo_slam {
namespace {

/// The landmark's plane in the keyframe, whose disparity has the slope that was measured there.
[[nodiscard]] std::optional<PlaneView> view_landmark(const Landmark& landmark, const Pose& T_keyframe_camera,
                                                     const StereoCamera& camera) {
  const auto z = project(to_point(landmark, landmark.mean, camera), Pose::identity(), camera);
  if (!z) return std::nullopt;
  return view_plane({*z, landmark.disparity_slope}, T_keyframe_camera, camera);
}

/// Measures landmarks of a keyframe in one frame.
struct PatchMeasurement {
  const PatchSource& source;
  const StereoView& view;
  const Pose& T_keyframe_camera;
  const RefinementSettings& settings;
  double texture;  // least texture of a patch of `source`

  /// Sub-pixel stereo measurement of a landmark, starting in the left image at `start_px`.
  [[nodiscard]] std::optional<RectificationResidual::Measurement> measure(
      const PredictedLandmark& predicted, const Vector2<double>& start_px) const {
    const Landmark& landmark = source.landmarks[predicted.index];
    const auto seen = view_landmark(landmark, T_keyframe_camera, view.camera);
    if (!seen) return std::nullopt;
    const auto patch = PatchTemplate::extract(source.left, landmark.anchor_px, seen->left, texture);
    if (!patch) return std::nullopt;
    const auto left = patch->align(view.frame.left, start_px, settings.max_shift_px);
    if (!left || left->correlation < settings.min_correlation) return std::nullopt;
    const StereoPoint expected(left->position_px.x(), left->position_px.y(), predicted.z.z());
    const auto right_patch = PatchTemplate::extract(source.left, landmark.anchor_px, seen->right, texture);
    if (!right_patch) return std::nullopt;
    const auto right = right_patch->align(view.frame.right, view.rectification.right_position(expected),
                                          settings.max_shift_px);
    if (!right || right->correlation < settings.min_correlation) return std::nullopt;
    auto measured = view.rectification.measure(left->position_px, right->position_px);
    if (std::abs(measured.row_error_px) > settings.max_row_error_px || !(measured.z.z() > 0.0)) {
      return std::nullopt;
    }
    measured.covariance_px2 = stereo_patch_covariance(left->covariance_px2, right->covariance_px2) +
                              stereo_pixel_covariance(settings.pixel_sigma_px);
    return measured;
  }

  /// Match of a landmark that agrees with its prediction.
  [[nodiscard]] std::optional<Match> match(const PredictedLandmark& predicted,
                                           const Vector2<double>& start_px) const {
    const auto measured = measure(predicted, start_px);
    if (!measured) return std::nullopt;
    const Vector3<double> innovation = measured->z - predicted.z;
    const Matrix3<double> S =
        predicted.landmark_part + predicted.pose_part + stereo_pixel_covariance(settings.gate_sigma_px);
    if (innovation.dot(S.llt().solve(innovation)) > kChi2_3_99) return std::nullopt;
    return Match{predicted.index, measured->z, measured->covariance_px2, predicted, std::nullopt};
  }
};

}  // namespace

std::vector<Match> align_landmarks(const Association& association, const PatchSource& source,
                                   const StereoView& view, const Pose& T_keyframe_camera,
                                   const RefinementSettings& settings) {
  const auto& predicted = association.predicted;
  const PatchMeasurement measurement{source, view, T_keyframe_camera, settings, min_texture(source.left)};

  std::vector<std::optional<Match>> refined(predicted.size());
  cv::parallel_for_(cv::Range(0, static_cast<int>(predicted.size())), [&](const cv::Range& range) {
    for (auto i = static_cast<std::size_t>(range.start); i < static_cast<std::size_t>(range.end); ++i) {
      const auto& start_px = association.search_start_px[i];
      if (start_px) refined[i] = measurement.match(predicted[i], *start_px);
    }
  });
  std::vector<Match> result;
  for (auto& match : refined) {
    if (match) result.push_back(std::move(*match));
  }
  return result;
}

}  // namespace stereo_slam
