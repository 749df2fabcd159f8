// SPDX-License-Identifier: MIT
#include "stereo_slam/odometry/displacement_search.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/LU>
#include <opencv2/imgproc.hpp>

#include "stereo_slam/core/opencv_points.hpp"
#include "stereo_slam/core/parallel.hpp"
#include "stereo_slam/frontend/patch_alignment.hpp"
#include "stereo_slam/odometry/motion_in_left.hpp"
#include "stereo_slam/odometry/two_view_adjustment.hpp"

namespace stereo_slam {
namespace {

constexpr std::size_t kFewestAgreeing = 15;
constexpr int kHalfPatch_px = 5;   // of the patch that is searched
const cv::Point kReach_px(14, 7);  // of the search: a vibration of 4 px reaches it once in 2000 frames
constexpr double kLeastCorrelation = 0.8;  // of the patches

/// Where the pattern around `left_px` is in the right image, near `expected_px`, to a whole pixel.
[[nodiscard]] std::optional<Vector2<double>> search_around(const cv::Mat& left, const cv::Mat& right,
                                                           const Vector2<double>& left_px,
                                                           const Vector2<double>& expected_px) {
  const auto centre = [](const Vector2<double>& px) {
    return cv::Point(static_cast<int>(std::lround(px.x())), static_cast<int>(std::lround(px.y())));
  };
  const cv::Point half(kHalfPatch_px, kHalfPatch_px), reach = kReach_px;
  const cv::Point at = centre(left_px), near = centre(expected_px);
  const cv::Rect pattern(at - half, at + half + cv::Point(1, 1));
  const cv::Rect window = cv::Rect(near - half - reach, near + half + reach + cv::Point(1, 1)) &
                          cv::Rect(cv::Point(), right.size());
  if ((pattern & cv::Rect(cv::Point(), left.size())) != pattern) return std::nullopt;
  if (window.width <= pattern.width || window.height <= pattern.height) return std::nullopt;
  cv::Mat correlation;
  cv::matchTemplate(right(window), left(pattern), correlation, cv::TM_CCOEFF_NORMED);
  double best = 0.0;
  cv::Point offset;
  cv::minMaxLoc(correlation, nullptr, &best, nullptr, &offset);
  if (!(best >= kLeastCorrelation)) return std::nullopt;
  const Vector2<double> fraction = left_px - to_eigen(cv::Point2f(at));
  return to_eigen(cv::Point2f(window.tl() + half + offset)) + fraction;
}

/// A point of the previous frame and where it is in the images of the current one.
struct FoundPoint {
  StereoPoint previous;
  StereoMeasurement current;
  Vector2<double> right_px;
};

/// Searches points in both images of `view`.
struct PointSearch {
  const StereoView& view;
  const Pose& T_previous_current;
  double texture;  // least texture of a patch

  [[nodiscard]] std::optional<FoundPoint> find(const StereoPlane& point,
                                               const Vector2<double>& left_px) const {
    const auto seen = view_plane(point, T_previous_current, view.camera);
    const auto warp = seen ? right_warp(seen->plane, view.geometry.exposure()) : std::nullopt;
    const auto patch = warp ? PatchTemplate::extract(view.frame.left, left_px, *warp, texture) : std::nullopt;
    if (!patch) return std::nullopt;
    const auto start_px = search_around(view.frame.left, view.frame.right, left_px,
                                        view.geometry.right_position(left_px, seen->plane.z.z()));
    const auto right = start_px ? patch->align(view.frame.right, *start_px) : std::nullopt;
    if (!right || right->correlation < kLeastCorrelation) return std::nullopt;
    return FoundPoint{point.z, view.geometry.measure(left_px, right->position_px), right->position_px};
  }
};

[[nodiscard]] std::vector<FoundPoint> find_points(const std::vector<StereoPlane>& all,
                                                  const ConsecutivePyramids& pyramids, const StereoView& view,
                                                  const Pose& T_previous_current,
                                                  const OdometrySettings& settings) {
  const auto followed = follow_in_left(all, pyramids, view, T_previous_current, settings);
  const PointSearch search{view, T_previous_current, min_texture(view.frame.left)};
  std::vector<std::optional<FoundPoint>> results(followed.size());
  run_each(followed.size(),
           [&](std::size_t i) { results[i] = search.find(followed[i].previous, followed[i].left_px); });
  std::vector<FoundPoint> found;
  for (const auto& result : results) {
    if (result) found.push_back(*result);
  }
  return found;
}

/// The motion that the positions in the left images show.
[[nodiscard]] std::optional<AgreedMotion> motion_of_found(const std::vector<FoundPoint>& points,
                                                          const StereoCamera& camera) {
  std::vector<StereoPoint> previous;
  std::vector<Vector2<double>> current_px;
  for (const auto& point : points) {
    previous.push_back(point.previous);
    current_px.emplace_back(point.current.z.head<2>());
  }
  return motion_by_positions(previous, current_px, camera);
}

/// The points linearised at a motion, seen in `view`.
[[nodiscard]] std::vector<DisplacementConstraint> linearise(const std::vector<FoundPoint>& points,
                                                            const Pose& T_previous_current,
                                                            const StereoView& view, double sigma_px) {
  const Matrix3<double> S_inverse = (2.0 * stereo_pixel_covariance(sigma_px)).inverse();  // both are noisy
  const Pose T_current_previous = T_previous_current.inverse();
  std::vector<DisplacementConstraint> constraints;
  for (const auto& point : points) {
    const auto expected = seen_by_second(point.previous, T_current_previous, view.camera);
    if (!expected) continue;
    const StereoMeasurement current = view.geometry.measure(point.current.left_px, point.right_px);
    constraints.push_back({.innovation = current.z - expected->z,
                           .S_inverse = S_inverse,
                           .J_pose = expected->J_motion,
                           .row_error_px = current.row_error_px,
                           .basis = ImageDisplacement::basis(point.right_px, view.camera)});
  }
  return constraints;
}

}  // namespace

std::optional<DisplacementEstimate> search_displacement(const std::vector<StereoPlane>& previous,
                                                        const ConsecutivePyramids& pyramids,
                                                        const StereoView& view,
                                                        const Pose& expected_T_previous_current,
                                                        const DisplacementPrior& prior,
                                                        const OdometrySettings& settings) {
  constexpr int kLinearisations = 3;
  const auto points = find_points(previous, pyramids, view, expected_T_previous_current, settings);
  if (points.size() < kFewestAgreeing) return std::nullopt;
  const auto in_left = motion_of_found(points, view.camera);
  if (!in_left) return std::nullopt;
  std::vector<FoundPoint> agreeing_in_left;
  for (const std::size_t i : in_left->agreeing) agreeing_in_left.push_back(points[i]);
  Pose motion = in_left->T_previous_current;
  ImageDisplacement::Coefficients displacement = ImageDisplacement::Coefficients::Zero();
  std::optional<DisplacementEstimate> estimate;
  for (int i = 0; i < kLinearisations; ++i) {
    DisplacementPrior relative = prior;
    relative.mean -= displacement;
    StereoView displaced = view;
    displaced.geometry = view.geometry.displaced_further(displacement);
    estimate = estimate_displacement(linearise(agreeing_in_left, motion, displaced, settings.pixel_sigma_px),
                                     relative);
    if (!estimate) return std::nullopt;
    motion = motion.boxplus(estimate->pose_change);
    displacement += estimate->change;
  }
  estimate->change = displacement;
  const auto agreeing = static_cast<std::size_t>(estimate->agreeing);
  if (agreeing < kFewestAgreeing || 2 * agreeing < points.size()) return std::nullopt;
  return estimate;
}

}  // namespace stereo_slam
