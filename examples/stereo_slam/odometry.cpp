// SPDX-License-Identifier: MIT
#include "odometry.hpp"

#include <algorithm>
#include <cmath>

#include "motion_estimation.hpp"
#include "spatial_index.hpp"
#include "stereo_matching.hpp"

namespace stereo_slam {
namespace {

using Points = std::vector<cv::Point2f>;

[[nodiscard]] cv::Point2f to_cv(const Vector2<double>& p) {
  return {static_cast<float>(p.x()), static_cast<float>(p.y())};
}

[[nodiscard]] Vector2<double> to_eigen(const cv::Point2f& p) { return {p.x, p.y}; }

/// Start of every leg of the circle.
struct CirclePrediction {
  Points previous_left, previous_right, current_left;
  std::vector<float> current_disparity;
};

[[nodiscard]] CirclePrediction predict_circle(const std::vector<StereoPoint>& points, const StereoCamera& camera,
                                              const Pose& T_previous_current) {
  CirclePrediction result;
  const Pose T_current_previous = T_previous_current.inverse();
  for (const auto& z : points) {
    const auto predicted = camera.project(T_current_previous * camera.back_project(z)).value_or(z);
    result.previous_left.push_back(to_cv(z.head<2>()));
    result.previous_right.push_back(to_cv({z.x() - z.z(), z.y()}));
    result.current_left.push_back(to_cv(predicted.head<2>()));
    result.current_disparity.push_back(static_cast<float>(predicted.z()));
  }
  return result;
}

/// Correspondences of the points that close the circle.
[[nodiscard]] std::vector<StereoCorrespondence> match_circle(const StereoPyramid& previous,
                                                             const StereoPyramid& current,
                                                             const std::vector<StereoPoint>& points,
                                                             const CirclePrediction& start,
                                                             const OdometrySettings& settings) {
  const FlowOptions options{.window_px = settings.window_px, .max_level = settings.pyramid_levels - 1};
  const auto current_left =
      track_points(previous.left, current.left, start.previous_left, start.current_left, options);
  Points right_guess = current_left.points;
  for (std::size_t i = 0; i < right_guess.size(); ++i) right_guess[i].x -= start.current_disparity[i];
  const auto current_right = track_points(current.left, current.right, current_left.points, right_guess, options);
  const auto previous_right =
      track_points(current.right, previous.right, current_right.points, start.previous_right, options);
  const auto closed =
      track_points(previous.right, previous.left, previous_right.points, start.previous_left, options);

  std::vector<StereoCorrespondence> matches;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!(current_left.found[i] && current_right.found[i] && previous_right.found[i] && closed.found[i])) continue;
    const Vector2<double> left = to_eigen(current_left.points[i]);
    const Vector2<double> right = to_eigen(current_right.points[i]);
    const double loop_error = (to_eigen(closed.points[i]) - points[i].head<2>()).norm();
    const double disparity = left.x() - right.x();
    if (loop_error > settings.max_loop_error_px || std::abs(left.y() - right.y()) > settings.max_row_error_px ||
        disparity <= 0.0) {
      continue;
    }
    matches.push_back({points[i], StereoPoint(left.x(), left.y(), disparity)});
  }
  return matches;
}

}  // namespace

std::vector<StereoPoint> select_odometry_points(const std::vector<Feature>& features,
                                                const std::vector<Vector2<double>>& reserved_px,
                                                const StereoFrame& frame, const Settings& settings) {
  const SpatialIndex reserved(reserved_px, frame.left.size());
  std::vector<const Feature*> free;
  for (const auto& feature : features) {
    if (!reserved.any_within(feature.position_px, settings.odometry.exclusion_px)) free.push_back(&feature);
  }
  std::stable_sort(free.begin(), free.end(), [](auto* a, auto* b) { return a->response > b->response; });
  std::vector<Vector2<double>> candidates;
  for (const auto* feature : free) candidates.push_back(feature->position_px);
  std::vector<Vector2<double>> chosen;
  for (const std::size_t i : spread_over_buckets(candidates, frame.left.size(), settings.odometry.cell_px,
                                                 static_cast<std::size_t>(settings.odometry.max_points))) {
    chosen.push_back(candidates[i]);
  }
  std::vector<StereoPoint> points;
  for (const auto& match : match_stereo(frame.left, frame.right, chosen, settings.stereo)) {
    if (match) points.push_back(*match);
  }
  return points;
}

OdometryResult estimate_odometry(const StereoPyramid& previous, const std::vector<StereoPoint>& points,
                                 const StereoPyramid& current, const StereoCamera& camera,
                                 const Pose& predicted_T_previous_current, std::uint64_t seed,
                                 const OdometrySettings& settings) {
  const auto start = predict_circle(points, camera, predicted_T_previous_current);
  const auto matches = match_circle(previous, current, points, start, settings);
  std::mt19937_64 random(seed);
  const auto motion = estimate_motion(matches, camera, predicted_T_previous_current, settings, random);

  OdometryResult result;
  result.valid = motion.valid;
  result.T_previous_current = motion.T_previous_current;
  result.tracked = static_cast<int>(matches.size());
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (motion.inlier[i]) result.inliers_px.push_back(matches[i].current.head<2>());
  }
  return result;
}

}  // namespace stereo_slam
