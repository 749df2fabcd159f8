// SPDX-License-Identifier: MIT
#include "stereo_slam/tracking/match_refinement.hpp"

#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "stereo_slam/core/chi_square.hpp"
#include "stereo_slam/frontend/patch_alignment.hpp"

namespace stereo_slam {
namespace {

/// Warp of the patch from keyframe to current pixels, for a surface parallel to the keyframe's image plane.
[[nodiscard]] std::optional<Matrix2<double>> patch_warp(const Landmark& landmark,
                                                        const Pose& T_keyframe_camera,
                                                        const StereoCamera& camera) {
  constexpr double kStep_px = 5.0;
  Matrix2<double> warp;
  const StereoPoint anchor = project(to_point(landmark, landmark.mean, camera), Pose::identity(), camera)
                                 .value_or(StereoPoint::Zero());
  if (!(anchor.z() > 0.0)) return std::nullopt;
  const auto warped = [&](const Vector2<double>& offset) {
    const Vector3<double> z = anchor + Vector3<double>(offset.x(), offset.y(), 0.0);
    return camera.project(T_keyframe_camera.inverse() * camera.back_project(z));
  };
  for (int axis = 0; axis < 2; ++axis) {
    const Vector2<double> offset = kStep_px * Vector2<double>::Unit(axis);
    const auto ahead = warped(offset);
    const auto behind = warped(-offset);
    if (!ahead || !behind) return std::nullopt;
    warp.col(axis) = (*ahead - *behind).head<2>() / (2.0 * kStep_px);
  }
  if (!(std::abs(warp.determinant()) > 0.05)) return std::nullopt;
  return warp;
}

/// Measures landmarks of a keyframe in one frame.
struct PatchMeasurement {
  const PatchSource& source;
  const StereoView& view;
  const Pose& T_keyframe_camera;
  const RefinementSettings& settings;

  /// Sub-pixel stereo measurement of a landmark, starting in the left image at `start_px`.
  [[nodiscard]] std::optional<StereoPoint> measure(const PredictedLandmark& predicted,
                                                   const Vector2<double>& start_px) const {
    const Landmark& landmark = source.landmarks[predicted.index];
    const auto warp = patch_warp(landmark, T_keyframe_camera, view.camera);
    if (!warp) return std::nullopt;
    const auto patch = PatchTemplate::extract(source.left, landmark.anchor_px, warp->inverse());
    if (!patch) return std::nullopt;
    const auto left = patch->align(view.frame.left, start_px, settings.max_shift_px);
    if (!left || left->correlation < settings.min_correlation) return std::nullopt;
    const StereoPoint expected(left->position_px.x(), left->position_px.y(), predicted.z.z());
    const auto right =
        patch->align(view.frame.right, view.rectification.right_position(expected), settings.max_shift_px);
    if (!right || right->correlation < settings.min_correlation) return std::nullopt;
    const auto measured = view.rectification.measure(left->position_px, right->position_px);
    if (std::abs(measured.row_error_px) > settings.max_row_error_px || !(measured.z.z() > 0.0)) {
      return std::nullopt;
    }
    return measured.z;
  }

  /// Match of a landmark that agrees with its prediction.
  [[nodiscard]] std::optional<Match> match(const PredictedLandmark& predicted,
                                           const Vector2<double>& start_px) const {
    const auto z = measure(predicted, start_px);
    if (!z) return std::nullopt;
    const Vector3<double> innovation = *z - predicted.z;
    const Matrix3<double> S =
        predicted.landmark_part + predicted.pose_part + stereo_pixel_covariance(settings.gate_sigma_px);
    if (innovation.dot(S.llt().solve(innovation)) > kChi2_3_99) return std::nullopt;
    return Match{predicted.index, *z, stereo_pixel_covariance(settings.pixel_sigma_px), predicted,
                 std::nullopt};
  }
};

}  // namespace

std::vector<Match> refine_matches(const Association& association, const PatchSource& source,
                                  const StereoView& view, const Pose& T_keyframe_camera,
                                  const RefinementSettings& settings) {
  const auto& predicted = association.predicted;
  const PatchMeasurement measurement{source, view, T_keyframe_camera, settings};

  std::vector<std::optional<Match>> refined(predicted.size());
  cv::parallel_for_(cv::Range(0, static_cast<int>(predicted.size())), [&](const cv::Range& range) {
    for (auto i = static_cast<std::size_t>(range.start); i < static_cast<std::size_t>(range.end); ++i) {
      const auto& start_px = association.static_px[i];
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
