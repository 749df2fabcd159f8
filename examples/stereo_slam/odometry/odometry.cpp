// SPDX-License-Identifier: MIT
#include "stereo_slam/odometry/odometry.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>

#include "stereo_slam/core/opencv_points.hpp"
#include "stereo_slam/core/pixel_noise.hpp"
#include "stereo_slam/core/pose_estimate.hpp"
#include "stereo_slam/frontend/stereo_matching.hpp"
#include "stereo_slam/odometry/motion_estimation.hpp"

namespace stereo_slam {
namespace {

constexpr double kMaxClosureError_px = 1.0;  // where circular matching ends, from where it began

using Points = std::vector<cv::Point2f>;

/// Correspondences of the points that circular matching brings back to where they started.
[[nodiscard]] std::vector<StereoCorrespondence> match_circle(const ConsecutivePyramids& pyramids,
                                                             const std::vector<StereoPoint>& points,
                                                             const StereoView& view,
                                                             const Pose& T_previous_current,
                                                             const OdometrySettings& settings) {
  const auto& [previous, current] = pyramids;
  const StereoCamera& camera = view.camera;
  const auto& geometry = view.geometry;
  const FlowOptions options{.window_px = settings.window_px, .max_level = settings.pyramid_levels - 1};
  const Pose T_current_previous = T_previous_current.inverse();
  Points previous_left, previous_right, left_guess;
  std::vector<StereoPoint> predicted;
  for (const auto& z : points) {
    predicted.push_back(camera.project(T_current_previous * camera.back_project(z)).value_or(z));
    previous_left.push_back(to_cv(geometry.left_position(z)));
    previous_right.push_back(to_cv(geometry.right_position(z)));
    left_guess.push_back(to_cv(geometry.left_position(predicted.back())));
  }
  const auto left = track_points(previous.left, current.left, previous_left, left_guess, options);
  Points right_guess;
  for (std::size_t i = 0; i < points.size(); ++i) {
    right_guess.push_back(to_cv(geometry.right_position(to_eigen(left.points[i]), predicted[i].z())));
  }
  const auto right = track_points(current.left, current.right, left.points, right_guess, options);
  const auto back = track_points(current.right, previous.right, right.points, previous_right, options);
  const auto closed = track_points(previous.right, previous.left, back.points, previous_left, options);

  std::vector<StereoCorrespondence> matches;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!(left.found[i] && right.found[i] && back.found[i] && closed.found[i])) continue;
    const double closure_error_px = (to_eigen(closed.points[i]) - to_eigen(previous_left[i])).norm();
    const auto measured = geometry.measure(to_eigen(left.points[i]), to_eigen(right.points[i]));
    if (closure_error_px > kMaxClosureError_px ||
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

/// Points followed with an expected motion, and the motion that they show.
struct MotionOfTracks {
  PointTracks tracks;
  std::vector<StereoCorrespondence> matches;
  RightImageFit right_image;
  MotionEstimate motion;

  [[nodiscard]] const Pose& pose() const { return motion.T_previous_current.pose; }
};

[[nodiscard]] MotionOfTracks motion_of(PointTracks tracks, const ConsecutivePyramids& pyramids,
                                       const StereoView& view, const ExpectedMotion& expected,
                                       const Settings& settings) {
  MotionOfTracks result;
  result.right_image = tracks.follow(pyramids, view, expected.T_previous_current, settings.odometry);
  result.tracks = std::move(tracks);
  result.matches = correspondences(result.tracks.points());
  std::mt19937_64 random(settings.seed + view.frame.index);
  result.motion = estimate_motion(result.matches, view.camera, expected, settings.odometry, random);
  return result;
}

/// The extent in the image of the points that agree with the measured motion and not with the other one. The
/// image is divided into columns and rows, each a sixteenth of its width; the extent is the number of columns
/// times the number of rows with at least two such points, however dense the points are.
[[nodiscard]] int extent_of(const MotionOfTracks& measured, const Pose& other, const StereoView& view,
                            const OdometrySettings& settings) {
  constexpr int kColumns = 16;
  const int strip_px = view.frame.left.cols / kColumns + 1;
  const auto agree = agreement(measured.matches, view.camera, measured.pose(), settings);
  const auto agree_with_other = agreement(measured.matches, view.camera, other, settings);
  std::map<int, int> columns, rows;  // points in each
  for (std::size_t i = 0; i < agree.size(); ++i) {
    if (!agree[i] || agree_with_other[i]) continue;
    ++columns[static_cast<int>(measured.matches[i].current.x()) / strip_px];
    ++rows[static_cast<int>(measured.matches[i].current.y()) / strip_px];
  }
  const auto occupied = [](const std::map<int, int>& strips) {
    return static_cast<int>(
        std::count_if(strips.begin(), strips.end(), [](const auto& strip) { return strip.second >= 2; }));
  };
  return occupied(columns) * occupied(rows);
}

/// The motion of the points that the measured one leaves out, if they extend over more of the image once they
/// are followed with it. Needed if no motion is expected, as in the first frame: the optical flow then finds
/// points that rest in the image more easily than others, and those of a part of the vehicle in view, such as
/// its bonnet, may win.
[[nodiscard]] std::optional<MotionOfTracks> motion_of_larger_part(const MotionOfTracks& measured,
                                                                  PointTracks tracks,
                                                                  const ConsecutivePyramids& pyramids,
                                                                  const StereoView& view,
                                                                  const Settings& settings) {
  constexpr double kMajority = 1.25;
  std::vector<StereoCorrespondence> others;
  for (std::size_t i = 0; i < measured.matches.size(); ++i) {
    if (!measured.motion.is_inlier[i]) others.push_back(measured.matches[i]);
  }
  std::mt19937_64 random(settings.seed + view.frame.index);
  const auto motion = estimate_motion(others, view.camera, {measured.pose()}, settings.odometry, random);
  if (!motion.valid) return std::nullopt;
  Settings fit_this_one = settings;
  fit_this_one.odometry.ransac_iterations = 0;
  auto followed =
      motion_of(std::move(tracks), pyramids, view, {motion.T_previous_current.pose}, fit_this_one);
  const int extent = extent_of(followed, measured.pose(), view, settings.odometry);
  const int before = extent_of(measured, followed.pose(), view, settings.odometry);
  if (!followed.motion.valid || !(extent > kMajority * before)) return std::nullopt;
  return followed;
}

/// The motion with the error that all points of a frame have in common, which their residuals do not show:
/// the light on a surface changes, or a vehicle hides half of what moves. Its size is that with which five
/// rendered drives have the right share of poses inside (docs/results/history/2026-11-29-one-estimator.md).
[[nodiscard]] PoseGaussian with_shared_error(PoseGaussian motion, const StereoCamera& camera) {
  const Vector6<double> sigma = kSharedInFrame_px / camera.fx * common_error_per_rad(motion);
  motion.covariance.diagonal() += sigma.cwiseAbs2();
  return motion;
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
      estimate_motion(matches, view.camera, expected, settings.odometry, random, static_matches);
  OdometryResult result{motion.valid, motion.T_previous_current, {}, motion.surprising, {}, 0};
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (motion.is_inlier[i]) result.inliers.push_back(matches[i]);
  }
  return result;
}

OdometryResult odometry_from_tracks(PointTracks& tracks, const ConsecutivePyramids& pyramids,
                                    const StereoView& view, const ExpectedMotion& expected,
                                    const Settings& settings) {
  const bool first = !expected.known();
  const std::size_t points = tracks.points().size();
  PointTracks before_this_frame = first ? tracks : PointTracks();
  MotionOfTracks measured = motion_of(std::move(tracks), pyramids, view, expected, settings);
  if (first && measured.motion.valid) {
    auto better = motion_of_larger_part(measured, std::move(before_this_frame), pyramids, view, settings);
    if (better) measured = *std::move(better);
  }
  tracks = std::move(measured.tracks);
  tracks.keep(measured.motion.is_inlier);
  return {measured.motion.valid,
          with_shared_error(measured.motion.T_previous_current, view.camera),
          correspondences(tracks.points()),
          measured.motion.surprising,
          measured.right_image,
          points};
}

}  // namespace stereo_slam
