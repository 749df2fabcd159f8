// SPDX-License-Identifier: MIT
#include "stereo_slam/tracking/motion_stereo.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <Eigen/LU>

#include <antipode/distributions/pose_algebra.hpp>

#include "stereo_slam/core/chi_square.hpp"
#include "stereo_slam/core/opencv_points.hpp"
#include "stereo_slam/core/pixel_noise.hpp"
#include "stereo_slam/frontend/likely_slopes.hpp"
#include "stereo_slam/frontend/patch_alignment.hpp"
#include "stereo_slam/frontend/plane_warp.hpp"
#include "stereo_slam/local_map/landmark.hpp"
#include "stereo_slam/local_map/motion_disparity.hpp"

namespace stereo_slam {
namespace {

constexpr double kLeastCorrelation = 0.85;  // of aligned patches, as of stereo matches
constexpr double kLeastDisparity_px = 0.3;  // as of stereo matches
// A depth counts as known if its disparity is known to a tenth, or as well as a rough stereo match.
constexpr double kKnownShare = 0.1;
constexpr double kKnown_px = 0.3;

/// A measurement by motion, and what the motion's error does to it.
struct Measurement {
  StereoMeasurement measured;
  Vector6<double> scale_by_motion = Vector6<double>::Zero();  ///< d log disparity / d motion
  Vector2<double> scale_by_lens = Vector2<double>::Zero();    ///< d log disparity / d lens coefficients
};

/// The view of a second camera on a point of the first one; nothing where it is not in front of it.
[[nodiscard]] std::optional<StereoPoint> seen_by(const StereoPoint& z, const Pose& T_first_second,
                                                 const StereoCamera& camera) {
  if (!(z.z() > 0.0)) return std::nullopt;
  return camera.project(T_first_second.inverse() * camera.back_project(z));
}

[[nodiscard]] Matrix2<double> pixel_noise(double sigma_px) {
  return sigma_px * sigma_px * Matrix2<double>::Identity();
}

/// A patch of an earlier left image found in another one.
struct AlignedPatch {
  PatchTemplate::Alignment at;
  Vector2<double> disparity_slope;  ///< in the other image
};

/// Aligns the patch of a point, as the surface through it that fits best would look.
[[nodiscard]] std::optional<AlignedPatch> align_patch(const cv::Mat& source, const Vector2<double>& source_px,
                                                      const StereoPoint& z, const Pose& T_source_current,
                                                      const cv::Mat& left, const Vector2<double>& px,
                                                      const StereoCamera& camera) {
  const double texture = min_texture(source);
  std::optional<AlignedPatch> best;
  const LikelySlopes slopes(z, camera);
  for (const auto& slope : slopes.all()) {
    const auto view = view_plane({z, slope}, T_source_current, camera);
    if (!view) continue;
    const auto patch = PatchTemplate::extract(source, source_px, view->left, texture);
    const auto found = patch ? patch->align(left, px) : std::nullopt;
    if (!found || found->correlation < std::max(kLeastCorrelation, best ? best->at.correlation : 0.0))
      continue;
    best = AlignedPatch{*found, view->plane.disparity_slope};
  }
  return best;
}

/// Whether a disparity with this variance is known well enough for a landmark.
[[nodiscard]] bool is_known(double disparity_px, double variance_px2) {
  return disparity_px >= kLeastDisparity_px &&
         variance_px2 < std::pow(std::max(kKnownShare * disparity_px, kKnown_px), 2);
}

/// The landmark of a match as a point of the current frame, with the depth that it has in the map.
[[nodiscard]] std::optional<Measurement> measured_landmark(const Match& match, const MapView& map,
                                                           const PoseGaussian& T_keyframe_current) {
  const Landmark& landmark = map.landmarks[match.landmark];
  const HomogeneousPoint point = to_point(landmark, landmark.mean, map.camera);
  const auto view =
      view_plane({landmark.mean, landmark.disparity_slope}, T_keyframe_current.pose, map.camera);
  if (!view) return std::nullopt;
  const Matrix3<double> J = landmark_jacobian(landmark, T_keyframe_current.pose, map.camera);
  const auto J_pose = pose_jacobian(point, T_keyframe_current.pose, map.camera);
  const Matrix3<double> S =
      J * landmark.covariance * J.transpose() + J_pose * T_keyframe_current.covariance * J_pose.transpose();
  const Vector2<double> error = (match.z - view->plane.z).head<2>();
  const Matrix2<double> S_px = (S + match.R).topLeftCorner<2, 2>();
  if (error.dot(S_px.inverse() * error) > kChi2_2_99 || !is_known(view->plane.z.z(), S(2, 2)))
    return std::nullopt;
  Measurement result;
  result.measured.z = {match.z.x(), match.z.y(), view->plane.z.z()};
  result.measured.left_px = match.left_px;
  result.measured.disparity_slope = view->plane.disparity_slope;
  result.measured.covariance_px2.topLeftCorner<2, 2>() = match.R.topLeftCorner<2, 2>();
  result.measured.covariance_px2(2, 2) = S(2, 2);
  return result;
}

/// The corner that was at `source_px` in an earlier left image, if the motion tells its depth.
[[nodiscard]] std::optional<Measurement> measured_corner(const Vector2<double>& source_px,
                                                         const AlignedPatch& aligned,
                                                         const PoseGaussian& T_source_current,
                                                         const LeftCamera& camera) {
  const Vector2<double>& left_px = aligned.at.position_px;
  const LeftPosition first{camera.lens.corrected(source_px),
                           aligned.at.covariance_px2 + pixel_noise(kOldPatchSigma_px)};
  const LeftPosition second{camera.lens.corrected(left_px), pixel_noise(kOldPatchSigma_px)};
  const auto seen = disparity_by_motion(first, second, T_source_current, camera.camera);
  if (!seen || seen->squared_distance > kChi2_2_99 || !is_known(seen->px, seen->variance_px2))
    return std::nullopt;
  Measurement result;
  result.measured.z = {second.px.x(), second.px.y(), seen->px};
  result.measured.left_px = left_px;
  result.measured.disparity_slope = aligned.disparity_slope;
  result.measured.covariance_px2.topLeftCorner<2, 2>() = second.covariance_px2;
  result.measured.covariance_px2(2, 2) =
      seen->variance_px2 +
      (seen->by_motion * T_source_current.covariance * seen->by_motion.transpose()).value();
  result.scale_by_motion = seen->by_motion.transpose() / seen->px;
  const Eigen::RowVector2d by_lens =
      seen->by_first * camera.lens.basis(source_px) + seen->by_second * camera.lens.basis(left_px);
  result.scale_by_lens = by_lens.transpose() / seen->px;
  return result;
}

/// The error of the scale that the measurements share: their weighted mean, as the pose would take it.
[[nodiscard]] double common_scale_sigma(const std::vector<Measurement>& measurements,
                                        const PoseGaussian& T_keyframe_current,
                                        const Eigen::Matrix<double, 6, LensResidual::kTerms>& motion_by_lens,
                                        const LeftCamera& camera) {
  Vector6<double> by_motion = Vector6<double>::Zero();
  Vector2<double> by_lens = Vector2<double>::Zero();
  double weights = 0.0;
  for (const auto& [measured, scale_by_motion, scale_by_lens] : measurements) {
    const double weight = measured.z.z() * measured.z.z() / measured.covariance_px2(2, 2);
    by_motion += weight * scale_by_motion;
    by_lens += weight * scale_by_lens;
    weights += weight;
  }
  if (!(weights > 0.0)) return 0.0;
  by_motion /= weights;
  by_lens /= weights;
  by_lens += motion_by_lens.transpose() * by_motion;
  return std::sqrt(std::max(by_motion.dot(T_keyframe_current.covariance * by_motion) +
                                by_lens.dot(camera.lens_covariance_px2 * by_lens),
                            0.0));
}

}  // namespace

void MotionStereo::add(const cv::Mat& left, const Pose& T_keyframe_camera,
                       const std::vector<Vector2<double>>& corners_px, double disparity_px) {
  constexpr std::size_t kMostSources = 8;  // each keeps an image
  if (corners_px.empty()) return;
  drop_unused_sources();
  if (sources_.size() == kMostSources) {
    std::erase_if(corners_, [](const Corner& corner) { return corner.source == 0; });
    drop_unused_sources();
  }
  for (const auto& px : corners_px) corners_.push_back({sources_.size(), px, px, disparity_px, false});
  sources_.push_back({left.clone(), {T_keyframe_camera, Matrix6<double>::Zero()}});
}

void MotionStereo::drop_unused_sources() {
  std::vector<std::size_t> kept(sources_.size(), 0);
  for (const auto& corner : corners_) kept[corner.source] = 1;
  std::vector<Source> sources;
  for (std::size_t i = 0; i < sources_.size(); ++i) {
    const bool used = kept[i] != 0;
    kept[i] = sources.size();
    if (used) sources.push_back(std::move(sources_[i]));
  }
  for (auto& corner : corners_) corner.source = kept[corner.source];
  sources_ = std::move(sources);
}

void MotionStereo::change_keyframe(const PoseGaussian& T_previous_keyframe) {
  std::erase_if(corners_, [](const Corner& corner) { return corner.is_known; });
  drop_unused_sources();
  for (auto& source : sources_)
    source.T_keyframe_source = antipode::relative_pose(T_previous_keyframe, source.T_keyframe_source);
}

void MotionStereo::follow(const ConsecutivePyramids& pyramids, const Pose& T_keyframe_previous,
                          const PoseGaussian& T_keyframe_current, const LeftCamera& camera) {
  std::vector<cv::Point2f> from, guess;
  for (const auto& corner : corners_) {
    const Pose T_source_keyframe = sources_[corner.source].T_keyframe_source.pose.inverse();
    const Vector2<double> source_px = camera.lens.corrected(corner.source_px);
    const StereoPoint z(source_px.x(), source_px.y(), corner.disparity_px);
    const auto before = seen_by(z, T_source_keyframe * T_keyframe_previous, camera.camera);
    const auto now = seen_by(z, T_source_keyframe * T_keyframe_current.pose, camera.camera);
    from.push_back(to_cv(corner.px));
    guess.push_back(
        to_cv(before && now ? Vector2<double>(corner.px + (*now - *before).head<2>()) : corner.px));
  }
  const auto flow = track_points(pyramids.previous.left, pyramids.current.left, from, guess, {});
  std::vector<PoseGaussian> T_source_current;
  for (const auto& source : sources_)
    T_source_current.push_back(antipode::relative_pose(source.T_keyframe_source, T_keyframe_current));
  std::vector<Corner> followed;
  for (std::size_t i = 0; i < corners_.size(); ++i) {
    if (!flow.found[i]) continue;
    Corner corner = corners_[i];
    corner.px = to_eigen(flow.points[i]);
    const PoseGaussian& motion = T_source_current[corner.source];
    const LeftPosition first{camera.lens.corrected(corner.source_px), pixel_noise(kOldPatchSigma_px)};
    const LeftPosition second{camera.lens.corrected(corner.px), pixel_noise(kFlowSigma_px)};
    const auto seen = disparity_by_motion(first, second, motion, camera.camera);
    if (seen) {
      const bool behind = seen->px < -3.0 * std::sqrt(seen->variance_px2);
      if (seen->squared_distance > kChi2_2_99 || behind) continue;
      corner.is_known = is_known(seen->px, seen->variance_px2);
      const StereoPoint z(second.px.x(), second.px.y(), seen->px);
      const auto in_source =
          corner.is_known ? seen_by(z, motion.pose.inverse(), camera.camera) : std::nullopt;
      if (in_source) corner.disparity_px = in_source->z();
    }
    followed.push_back(corner);
  }
  corners_ = std::move(followed);
}

std::size_t MotionStereo::known() const {
  return static_cast<std::size_t>(
      std::count_if(corners_.begin(), corners_.end(), [](const Corner& corner) { return corner.is_known; }));
}

std::vector<Vector2<double>> MotionStereo::positions() const {
  std::vector<Vector2<double>> result;
  for (const auto& corner : corners_) result.push_back(corner.px);
  return result;
}

StereoPoints MotionStereo::measure(const cv::Mat& left, const std::vector<Match>& matches, const MapView& map,
                                   const PoseGaussian& T_keyframe_current,
                                   const Eigen::Matrix<double, 6, LensResidual::kTerms>& motion_by_lens,
                                   const LeftCamera& camera) const {
  std::vector<Measurement> measurements;
  for (const auto& match : matches) {
    if (const auto landmark = measured_landmark(match, map, T_keyframe_current))
      measurements.push_back(*landmark);
  }
  for (const auto& corner : corners_) {
    if (!corner.is_known) continue;
    const Source& source = sources_[corner.source];
    const PoseGaussian T_source_current =
        antipode::relative_pose(source.T_keyframe_source, T_keyframe_current);
    const Vector2<double> source_px = camera.lens.corrected(corner.source_px);
    const StereoPoint z(source_px.x(), source_px.y(), corner.disparity_px);
    const auto aligned =
        align_patch(source.left, corner.source_px, z, T_source_current.pose, left, corner.px, camera.camera);
    if (!aligned) continue;
    if (const auto point = measured_corner(corner.source_px, *aligned, T_source_current, camera))
      measurements.push_back(*point);
  }
  StereoPoints result;
  result.scale_sigma = common_scale_sigma(measurements, T_keyframe_current, motion_by_lens, camera);
  for (auto& measurement : measurements) {
    measurement.measured.correlation = 1.0;  // the patches of both images were the same surface
    measurement.measured.on_common_surface = true;
    result.measured.push_back(measurement.measured);
  }
  return result;
}

}  // namespace stereo_slam
