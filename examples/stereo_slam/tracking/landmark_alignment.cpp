// SPDX-License-Identifier: MIT
#include "stereo_slam/tracking/landmark_alignment.hpp"

#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "stereo_slam/core/chi_square.hpp"
#include "stereo_slam/core/parallel.hpp"
#include "stereo_slam/core/pixel_noise.hpp"
#include "stereo_slam/frontend/patch_alignment.hpp"
#include "stereo_slam/frontend/plane_warp.hpp"

namespace stereo_slam {
namespace {

constexpr double kMinCorrelation = 0.8;  // of the aligned patches
constexpr double kMaxShift_px = 3.0;     // of the aligned position from its start
constexpr double kMaxRowError_px = 1.0;  // between left and right position: epipolar check

/// A landmark found in a stereo pair.
struct PairMeasurement {
  PairSearch search;
  std::optional<Match> match;
};

/// Measures landmarks of a keyframe in one frame.
struct PatchMeasurement {
  const PatchSource& source;
  const StereoView& view;
  const Pose& T_keyframe_camera;
  const RefinementSettings& settings;
  double texture;  // least texture of a patch of `source`

  /// The landmark in the images of the view, searched in the left one from `start_px` on.
  [[nodiscard]] PairMeasurement measure(const PredictedLandmark& predicted,
                                        const Vector2<double>& start_px) const {
    PairMeasurement result;
    const Landmark& landmark = source.landmarks[predicted.index];
    const auto seen = view_plane({landmark.mean, landmark.disparity_slope}, T_keyframe_camera, view.camera);
    if (!seen) return result;
    const auto left = align(landmark, seen->left, view.frame.left, start_px);
    if (!left) return result;
    result.search.in_left = true;
    const Vector2<double>& left_px = left->position_px;
    if (!view.right_is_usable) {
      const Vector2<double> corrected_px = view.geometry.lens().corrected(left_px);
      const StereoPoint z(corrected_px.x(), corrected_px.y(), predicted.z.z());
      result.match = match(predicted, {z, left_px}, without_disparity(*left));
      return result;
    }
    const auto warp = right_patch(*seen);
    if (!warp) return result;
    const auto right =
        align(landmark, *warp, view.frame.right, view.geometry.right_position(left_px, predicted.z.z()));
    if (!right) return result;
    const auto measured = view.geometry.measure(left_px, right->position_px);
    result.search.row_error_px = measured.row_error_px;
    if (std::abs(measured.row_error_px) > kMaxRowError_px || !(measured.z.z() > 0.0)) return result;
    result.match = match(predicted, measured, measured.with_disparity(covariance(*left, *right)));
    return result;
  }

 private:
  /// The warp from the right image to that of the keyframe.
  [[nodiscard]] std::optional<PatchWarp> right_patch(const PlaneView& seen) const {
    const LateExposure& exposure = view.geometry.exposure();
    if (!exposure.is_late()) return seen.right;
    const auto right = right_warp(seen.plane, exposure);
    if (!right) return std::nullopt;
    return PatchWarp{seen.left.linear * right->linear, seen.right.perspective};
  }

  /// Alignment of the landmark's patch, warped by `warp`, in one of the images; nothing if it does not agree.
  [[nodiscard]] std::optional<PatchTemplate::Alignment> align(const Landmark& landmark, const PatchWarp& warp,
                                                              const cv::Mat& image,
                                                              const Vector2<double>& start_px) const {
    const auto patch = PatchTemplate::extract(source.left, landmark.anchor_px, warp, texture);
    if (!patch) return std::nullopt;
    auto aligned = patch->align(image, start_px, kMaxShift_px);
    if (!aligned || aligned->correlation < kMinCorrelation) return std::nullopt;
    return aligned;
  }

  /// The match with a measurement, if that agrees with the prediction.
  [[nodiscard]] std::optional<Match> match(const PredictedLandmark& predicted,
                                           const StereoMeasurement& measured,
                                           const Matrix3<double>& R) const {
    const Vector3<double> innovation = measured.z - predicted.z;
    const Matrix3<double> S =
        predicted.landmark_part + predicted.pose_part + stereo_pixel_covariance(kGateSigma_px);
    if (innovation.dot(S.llt().solve(innovation)) > kChi2_3_99) return std::nullopt;
    return Match{.landmark = predicted.index,
                 .z = measured.z,
                 .left_px = measured.left_px,
                 .R = R,
                 .predicted = predicted,
                 .row_error_px = measured.row_error_px};
  }

  [[nodiscard]] Matrix3<double> covariance(const PatchTemplate::Alignment& left,
                                           const PatchTemplate::Alignment& right) const {
    return stereo_patch_covariance(left.covariance_px2, right.covariance_px2) +
           stereo_pixel_covariance(settings.pixel_sigma_px);
  }

  /// Covariance of a measurement in the left image alone.
  [[nodiscard]] Matrix3<double> without_disparity(const PatchTemplate::Alignment& left) const {
    Matrix3<double> R = covariance(left, left);
    R.row(2).setZero();
    R.col(2).setZero();
    R(2, 2) = kUnknownDisparity_px * kUnknownDisparity_px;
    return R;
  }
};

}  // namespace

void align_landmarks(Association& association, const PatchSource& source, const StereoView& view,
                     const Pose& T_keyframe_camera, const RefinementSettings& settings) {
  const auto& predicted = association.predicted;
  const PatchMeasurement measurement{source, view, T_keyframe_camera, settings, min_texture(source.left)};

  std::vector<PairMeasurement> measured(predicted.size());
  run_each(predicted.size(), [&](std::size_t i) {
    const auto& start_px = association.search_start_px[i];
    if (start_px) measured[i] = measurement.measure(predicted[i], *start_px);
  });
  std::vector<PairSearch> searches;
  for (auto& [search, match] : measured) {
    if (view.right_is_usable) searches.push_back(search);
    if (match) association.matches.push_back(std::move(*match));
  }
  association.right_image = fit_of(searches);
}

}  // namespace stereo_slam
