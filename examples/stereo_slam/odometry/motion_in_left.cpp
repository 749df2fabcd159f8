// SPDX-License-Identifier: MIT
#include "stereo_slam/odometry/motion_in_left.hpp"

#include <algorithm>

#include <opencv2/calib3d.hpp>

#include <antipode/opencv/pose.hpp>

#include "stereo_slam/core/opencv_points.hpp"
#include "stereo_slam/frontend/patch_alignment.hpp"

namespace stereo_slam {

std::vector<FollowedPoint> follow_in_left(const std::vector<StereoPlane>& previous,
                                          const ConsecutivePyramids& pyramids, const StereoView& view,
                                          const Pose& expected_T_previous_current,
                                          const OdometrySettings& settings) {
  constexpr std::size_t kMostPoints = 120;   // more hardly improve the estimate
  constexpr double kLeastCorrelation = 0.8;  // of the patches
  const std::size_t count = std::min(previous.size(), kMostPoints);
  std::vector<StereoPlane> planes;
  std::vector<PlaneView> expected;
  std::vector<cv::Point2f> from, guess;
  for (std::size_t i = 0; i < count; ++i) {
    const StereoPlane& plane = planes.emplace_back(previous[i * previous.size() / count]);
    expected.push_back(
        view_plane(plane, expected_T_previous_current, view.camera).value_or(PlaneView{plane, {}, {}}));
    from.push_back(to_cv(view.geometry.left_position(plane.z)));
    guess.push_back(to_cv(view.geometry.left_position(expected.back().plane.z)));
  }
  const FlowPyramid &before = pyramids.previous.left, &now = pyramids.current.left;
  const auto flow = track_points(before, now, from, guess,
                                 {.window_px = settings.window_px, .max_level = settings.pyramid_levels - 1});
  const double texture = min_texture(before.image());
  std::vector<FollowedPoint> followed;
  for (std::size_t i = 0; i < count; ++i) {
    if (!flow.found[i]) continue;
    const auto patch = PatchTemplate::extract(before.image(), to_eigen(from[i]), expected[i].left, texture);
    const auto left = patch ? patch->align(now.image(), to_eigen(flow.points[i])) : std::nullopt;
    if (left && left->correlation >= kLeastCorrelation) followed.push_back({planes[i], left->position_px});
  }
  return followed;
}

std::optional<AgreedMotion> motion_by_positions(const std::vector<StereoPoint>& previous,
                                                const std::vector<Vector2<double>>& current_px,
                                                const StereoCamera& camera) {
  constexpr int kDraws = 200;
  constexpr double kConfidence = 0.999;
  std::vector<cv::Point3d> before;
  std::vector<cv::Point2d> now;
  for (std::size_t i = 0; i < previous.size(); ++i) {
    const Vector3<double> p = camera.back_project(previous[i]);
    before.emplace_back(p.x(), p.y(), p.z());
    now.emplace_back(current_px[i].x(), current_px[i].y());
  }
  const cv::Matx33d K(camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0);
  cv::Mat rotation, translation;
  std::vector<int> inliers;
  if (!cv::solvePnPRansac(before, now, K, cv::noArray(), rotation, translation, false, kDraws,
                          static_cast<float>(AgreedMotion::kMaxError_px), kConfidence, inliers) ||
      !cv::checkRange(rotation) || !cv::checkRange(translation)) {
    return std::nullopt;
  }
  return AgreedMotion{antipode::pose_from_cv<double>(rotation, translation).inverse(),
                      {inliers.begin(), inliers.end()}};
}

std::optional<Pose> motion_in_left(const std::vector<StereoPlane>& previous,
                                   const ConsecutivePyramids& pyramids, const StereoView& view,
                                   const Pose& expected_T_previous_current,
                                   const OdometrySettings& settings) {
  constexpr std::size_t kFewestAgreeing = 15;
  std::vector<StereoPoint> before;
  std::vector<Vector2<double>> now_px;
  for (const auto& point : follow_in_left(previous, pyramids, view, expected_T_previous_current, settings)) {
    before.push_back(point.previous.z);
    now_px.push_back(view.geometry.lens().corrected(point.left_px));
  }
  if (before.size() < kFewestAgreeing) return std::nullopt;
  const auto motion = motion_by_positions(before, now_px, view.camera);
  if (!motion || motion->agreeing.size() < kFewestAgreeing || 2 * motion->agreeing.size() < before.size())
    return std::nullopt;
  return motion->T_previous_current;
}

}  // namespace stereo_slam
