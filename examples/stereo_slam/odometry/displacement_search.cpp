// SPDX-License-Identifier: MIT
#include "stereo_slam/odometry/displacement_search.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/LU>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include <antipode/geometry/quaternion.hpp>
#include <antipode/opencv/pose.hpp>

#include "stereo_slam/core/opencv_points.hpp"
#include "stereo_slam/frontend/patch_alignment.hpp"
#include "stereo_slam/frontend/plane_warp.hpp"

namespace stereo_slam {
namespace {

constexpr std::size_t kMostPoints = 120;  // more hardly improve the estimate
constexpr std::size_t kFewestAgreeing = 15;
constexpr int kHalfPatch_px = 5;   // of the patch that is searched
const cv::Point kReach_px(14, 7);  // of the search: a vibration of 4 px reaches it once in 2000 frames
constexpr double kLeastCorrelation = 0.8;  // of the patches
constexpr double kPriorSigma_px = 20.0;    // of a displacement of which nothing is known

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
    const auto warp = seen ? right_warp(seen->plane, view.rectification.exposure()) : std::nullopt;
    const auto patch = warp ? PatchTemplate::extract(view.frame.left, left_px, *warp, texture) : std::nullopt;
    if (!patch) return std::nullopt;
    const auto start_px = search_around(view.frame.left, view.frame.right, left_px,
                                        view.rectification.right_position(left_px, seen->plane.z.z()));
    const auto right = start_px ? patch->align(view.frame.right, *start_px) : std::nullopt;
    if (!right || right->correlation < kLeastCorrelation) return std::nullopt;
    return FoundPoint{point.z, view.rectification.measure(left_px, right->position_px), right->position_px};
  }
};

/// Some of the points, evenly chosen, and optical flow of them into the left image of `view`.
struct FlowOfPoints {
  std::vector<const StereoPlane*> points;
  FlowResult flow;

  FlowOfPoints(const std::vector<StereoPlane>& all, const ConsecutivePyramids& pyramids,
               const StereoView& view, const Pose& T_previous_current, const OdometrySettings& settings) {
    const std::size_t count = std::min(all.size(), kMostPoints);
    std::vector<cv::Point2f> from, guess;
    for (std::size_t i = 0; i < count; ++i) {
      points.push_back(&all[i * all.size() / count]);
      const StereoPoint& z = points.back()->z;
      const auto moved = view.camera.project(T_previous_current.inverse() * view.camera.back_project(z));
      from.push_back(to_cv(view.rectification.left_position(z)));
      guess.push_back(to_cv(view.rectification.left_position(moved.value_or(z))));
    }
    flow = track_points(pyramids.previous.left, pyramids.current.left, from, guess,
                        {.window_px = settings.window_px, .max_level = settings.pyramid_levels - 1});
  }
};

[[nodiscard]] std::vector<FoundPoint> find_points(const std::vector<StereoPlane>& all,
                                                  const ConsecutivePyramids& pyramids, const StereoView& view,
                                                  const Pose& T_previous_current,
                                                  const OdometrySettings& settings) {
  const FlowOfPoints followed(all, pyramids, view, T_previous_current, settings);
  const std::size_t count = followed.points.size();
  const PointSearch search{view, T_previous_current, min_texture(view.frame.left)};
  std::vector<std::optional<FoundPoint>> results(count);
  cv::parallel_for_(cv::Range(0, static_cast<int>(count)), [&](const cv::Range& range) {
    for (auto i = static_cast<std::size_t>(range.start); i < static_cast<std::size_t>(range.end); ++i) {
      if (followed.flow.found[i])
        results[i] = search.find(*followed.points[i], to_eigen(followed.flow.points[i]));
    }
  });
  std::vector<FoundPoint> found;
  for (const auto& result : results) {
    if (result) found.push_back(*result);
  }
  return found;
}

/// A motion, and which of the points agree with it.
struct AgreedMotion {
  Pose T_previous_current;
  std::vector<int> agreeing;
};

/// The motion between points of the previous frame and where the left image shows them now.
[[nodiscard]] std::optional<AgreedMotion> motion_between(const std::vector<cv::Point3d>& previous,
                                                         const std::vector<cv::Point2d>& current,
                                                         const StereoCamera& camera) {
  constexpr int kDraws = 200;
  constexpr float kMaxError_px = 2.0F;
  constexpr double kConfidence = 0.999;
  const cv::Matx33d K(camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0);
  cv::Mat rotation, translation;
  std::vector<int> inliers;
  if (!cv::solvePnPRansac(previous, current, K, cv::noArray(), rotation, translation, false, kDraws,
                          kMaxError_px, kConfidence, inliers) ||
      !cv::checkRange(rotation) || !cv::checkRange(translation)) {
    return std::nullopt;
  }
  return AgreedMotion{antipode::pose_from_cv<double>(rotation, translation).inverse(), std::move(inliers)};
}

[[nodiscard]] cv::Point3d point_of(const StereoPoint& z, const StereoCamera& camera) {
  const Vector3<double> p = camera.back_project(z);
  return {p.x(), p.y(), p.z()};
}

/// The motion that the positions in the left images show, and the points that agree with it.
struct MotionInLeft {
  Pose T_previous_current;
  std::vector<FoundPoint> points;
};

[[nodiscard]] std::optional<MotionInLeft> motion_of_found(const std::vector<FoundPoint>& points,
                                                          const StereoCamera& camera) {
  std::vector<cv::Point3d> previous;
  std::vector<cv::Point2d> current;
  for (const auto& point : points) {
    previous.push_back(point_of(point.previous, camera));
    current.emplace_back(point.current.z.x(), point.current.z.y());
  }
  const auto motion = motion_between(previous, current, camera);
  if (!motion) return std::nullopt;
  MotionInLeft result{motion->T_previous_current, {}};
  for (const int i : motion->agreeing) result.points.push_back(points[static_cast<std::size_t>(i)]);
  return result;
}

/// The points linearised at a motion.
[[nodiscard]] std::vector<DisplacementConstraint> linearise(const std::vector<FoundPoint>& points,
                                                            const Pose& T_previous_current,
                                                            const StereoCamera& camera, double sigma_px) {
  const Matrix3<double> S_inverse = (2.0 * stereo_pixel_covariance(sigma_px)).inverse();  // both are noisy
  std::vector<DisplacementConstraint> constraints;
  for (const auto& point : points) {
    const Vector3<double> p = T_previous_current.inverse() * camera.back_project(point.previous);
    const auto expected = camera.project(p);
    if (!expected) continue;
    const Matrix3<double> J = camera.projection_jacobian(p);
    DisplacementConstraint c{.innovation = point.current.z - *expected,
                             .S_inverse = S_inverse,
                             .J_pose = {},
                             .row_error_px = point.current.row_error_px,
                             .basis = ImageDisplacement::basis(point.right_px, camera)};
    c.J_pose << J * antipode::skew(p), -J;
    constraints.push_back(c);
  }
  return constraints;
}

}  // namespace

std::optional<Pose> motion_in_left(const std::vector<StereoPlane>& previous,
                                   const ConsecutivePyramids& pyramids, const StereoView& view,
                                   const Pose& expected_T_previous_current,
                                   const OdometrySettings& settings) {
  const FlowOfPoints followed(previous, pyramids, view, expected_T_previous_current, settings);
  std::vector<cv::Point3d> before;
  std::vector<cv::Point2d> now;
  for (std::size_t i = 0; i < followed.points.size(); ++i) {
    if (!followed.flow.found[i]) continue;
    const Vector2<double> px = view.rectification.lens().corrected(to_eigen(followed.flow.points[i]));
    before.push_back(point_of(followed.points[i]->z, view.camera));
    now.emplace_back(px.x(), px.y());
  }
  if (before.size() < kFewestAgreeing) return std::nullopt;
  const auto motion = motion_between(before, now, view.camera);
  if (!motion || motion->agreeing.size() < kFewestAgreeing || 2 * motion->agreeing.size() < before.size())
    return std::nullopt;
  return motion->T_previous_current;
}

std::optional<DisplacementEstimate> search_displacement(const std::vector<StereoPlane>& previous,
                                                        const ConsecutivePyramids& pyramids,
                                                        const StereoView& view,
                                                        const Pose& expected_T_previous_current,
                                                        const OdometrySettings& settings) {
  constexpr int kLinearisations = 3;
  const auto points = find_points(previous, pyramids, view, expected_T_previous_current, settings);
  if (points.size() < kFewestAgreeing) return std::nullopt;
  const auto in_left = motion_of_found(points, view.camera);
  if (!in_left) return std::nullopt;
  DisplacementPrior prior;
  prior.information.diagonal().setConstant(1.0 / (kPriorSigma_px * kPriorSigma_px));
  Pose motion = in_left->T_previous_current;
  std::optional<DisplacementEstimate> estimate;
  for (int i = 0; i < kLinearisations; ++i) {
    estimate = estimate_displacement(linearise(in_left->points, motion, view.camera, settings.pixel_sigma_px),
                                     prior);
    if (!estimate) return std::nullopt;
    motion = motion.boxplus(estimate->pose_change);
  }
  const auto agreeing = static_cast<std::size_t>(estimate->agreeing);
  if (agreeing < kFewestAgreeing || 2 * agreeing < points.size()) return std::nullopt;
  return estimate;
}

}  // namespace stereo_slam
