// SPDX-License-Identifier: MIT
#include "stereo_slam/odometry/odometry.hpp"

#include <cmath>

#include "stereo_slam/core/opencv_points.hpp"
#include "stereo_slam/frontend/stereo_matching.hpp"
#include "stereo_slam/odometry/motion_estimation.hpp"

namespace stereo_slam {
namespace {

using Points = std::vector<cv::Point2f>;

/// Correspondences of the points that circular matching brings back to where they started.
[[nodiscard]] std::vector<StereoCorrespondence> match_circle(const ConsecutivePyramids& pyramids,
                                                             const std::vector<StereoPoint>& points,
                                                             const StereoView& view,
                                                             const Pose& T_previous_current,
                                                             const OdometrySettings& settings) {
  const auto& [previous, current] = pyramids;
  const StereoCamera& camera = view.camera;
  const RectificationResidual& rectification = view.rectification;
  const FlowOptions options{.window_px = settings.window_px, .max_level = settings.pyramid_levels - 1};
  const Pose T_current_previous = T_previous_current.inverse();
  Points previous_left, previous_right, left_guess;
  std::vector<StereoPoint> predicted;
  for (const auto& z : points) {
    predicted.push_back(camera.project(T_current_previous * camera.back_project(z)).value_or(z));
    previous_left.push_back(to_cv(z.head<2>()));
    previous_right.push_back(to_cv(rectification.right_position(z)));
    left_guess.push_back(to_cv(predicted.back().head<2>()));
  }
  const auto left = track_points(previous.left, current.left, previous_left, left_guess, options);
  Points right_guess;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vector2<double> found = to_eigen(left.points[i]);
    right_guess.push_back(to_cv(rectification.right_position({found.x(), found.y(), predicted[i].z()})));
  }
  const auto right = track_points(current.left, current.right, left.points, right_guess, options);
  const auto back = track_points(current.right, previous.right, right.points, previous_right, options);
  const auto closed = track_points(previous.right, previous.left, back.points, previous_left, options);

  std::vector<StereoCorrespondence> matches;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!(left.found[i] && right.found[i] && back.found[i] && closed.found[i])) continue;
    const double closure_error_px = (to_eigen(closed.points[i]) - points[i].head<2>()).norm();
    const auto measured = rectification.measure(to_eigen(left.points[i]), to_eigen(right.points[i]));
    if (closure_error_px > settings.max_closure_error_px ||
        std::abs(measured.row_error_px) > settings.max_row_error_px || measured.z.z() <= 0.0) {
      continue;
    }
    matches.push_back({points[i], measured.z});
  }
  return matches;
}

/// At most `count` of the points, evenly from the list.
[[nodiscard]] std::vector<StereoPoint> thin_out(const std::vector<StereoPoint>& points, std::size_t count) {
  if (points.size() <= count) return points;
  std::vector<StereoPoint> kept;
  for (std::size_t i = 0; i < count; ++i) kept.push_back(points[i * points.size() / count]);
  return kept;
}

}  // namespace

std::vector<StereoPoint> select_odometry_points(const StereoView& view, const std::vector<Feature>& features,
                                                const std::vector<Vector2<double>>& reserved_px,
                                                const Settings& settings) {
  const cv::Size image = view.frame.left.size();
  const auto& rule = settings.odometry;
  const auto spread = spread_features(exclude_features(features, reserved_px, image, rule.exclusion_px),
                                      image, rule.cell_px, static_cast<std::size_t>(rule.max_points));
  std::vector<StereoPoint> points;
  for (const auto& match : match_stereo(view, positions(spread), settings.stereo)) {
    if (match) points.push_back(match->z);
  }
  return points;
}

OdometryResult odometry_from_circle(const ConsecutivePyramids& pyramids, const OdometryPoints& points,
                                    const StereoView& view, const ExpectedMotion& expected,
                                    const Settings& settings) {
  constexpr std::size_t kMaxStaticPoints = 100;  // enough to outvote a lorry
  const auto follow = [&](const std::vector<StereoPoint>& from) {
    return match_circle(pyramids, from, view, expected.T_previous_current, settings.odometry);
  };
  const auto matches = follow(points.points);
  const auto static_matches = follow(thin_out(points.static_points, kMaxStaticPoints));
  std::mt19937_64 random(settings.seed + view.frame.index);
  const auto motion =
      estimate_motion({matches, static_matches}, view.camera, expected, settings.odometry, random);
  OdometryResult result{motion.valid, motion.T_previous_current, {}, motion.jerk, {}};
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (motion.is_inlier[i]) result.inliers_px.push_back(matches[i].current.head<2>());
  }
  return result;
}

OdometryResult odometry_from_tracks(PointTracks& tracks, const ConsecutivePyramids& pyramids,
                                    const StereoView& view, const ExpectedMotion& expected,
                                    const Settings& settings) {
  constexpr std::size_t kStaticVotes = 3;  // besides its own: a lorry may have more points than the street
  const auto right_image = tracks.follow(pyramids, view, expected.T_previous_current, settings.odometry);
  const auto matches = correspondences(tracks.points());
  std::vector<StereoCorrespondence> static_matches;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (tracks.points()[i].is_static) static_matches.insert(static_matches.end(), kStaticVotes, matches[i]);
  }
  std::mt19937_64 random(settings.seed + view.frame.index);
  const auto motion =
      estimate_motion({matches, static_matches}, view.camera, expected, settings.odometry, random);
  tracks.keep(motion.is_inlier);
  return {motion.valid, motion.T_previous_current, tracks.positions(), motion.jerk, right_image};
}

}  // namespace stereo_slam
