// SPDX-License-Identifier: MIT
#include "stereo_slam/odometry/point_tracks.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/LU>

#include "stereo_slam/core/chi_square.hpp"
#include "stereo_slam/core/opencv_points.hpp"
#include "stereo_slam/core/parallel.hpp"
#include "stereo_slam/core/pixel_noise.hpp"
#include "stereo_slam/frontend/corners.hpp"
#include "stereo_slam/frontend/features.hpp"
#include "stereo_slam/frontend/patch_alignment.hpp"
#include "stereo_slam/frontend/plane_warp.hpp"
#include "stereo_slam/frontend/spatial_index.hpp"
#include "stereo_slam/frontend/stereo_matching.hpp"

namespace stereo_slam {
namespace {

constexpr double kMinCorrelation = 0.8;  // of aligned patches

/// A point as found in the current frame.
struct MeasuredPoint {
  PairSearch search;
  std::optional<StereoMeasurement> measured;
};

/// Measures points of the previous left image in the current frame.
struct PointMeasurement {
  const cv::Mat& previous_left;
  const StereoView& view;
  const OdometrySettings& settings;
  double previous_texture, texture;  // least texture of a patch of the previous and of the current left image

  /// Search for the point that was at `previous_px`, from `start_px` on; there is no measurement if its
  /// patches do not agree.
  [[nodiscard]] MeasuredPoint measure(const Vector2<double>& previous_px, const Vector2<double>& start_px,
                                      const PlaneView& expected) const {
    MeasuredPoint result;
    const auto before = PatchTemplate::extract(previous_left, previous_px, expected.left, previous_texture);
    if (!before) return result;
    const auto left = before->align(view.frame.left, start_px);
    if (!left || left->correlation < kMinCorrelation) return result;
    const auto warp = right_warp(expected.plane, view.geometry.exposure());
    if (!warp) return result;
    const auto now = PatchTemplate::extract(view.frame.left, left->position_px, *warp, texture);
    if (!now) return result;
    result.search.in_left = true;
    const auto right =
        now->align(view.frame.right, view.geometry.right_position(left->position_px, expected.plane.z.z()));
    if (!right || right->correlation < kMinCorrelation) return result;
    auto measured = view.geometry.measure(left->position_px, right->position_px);
    result.search.row_error_px = measured.row_error_px;
    if (std::abs(measured.row_error_px) > settings.max_row_error_px || !(measured.z.z() > 0.0)) return result;
    measured.covariance_px2 =
        measured.with_disparity(stereo_patch_covariance(left->covariance_px2, right->covariance_px2) +
                                stereo_pixel_covariance(kLeastTrackedSigma_px));
    result.measured = measured;
    return result;
  }
};

/// What an outlier costs that was static for some frames, as a multiple of the cost of a new point,
/// kChi2_3_99: the log-likelihood ratio of Bayes' rule is added. A third of the moving points agree with the
/// camera's motion by chance in one frame (docs/results/dynamic.md). The ratio is bounded, since what was
/// static for long may start to move.
[[nodiscard]] double static_evidence(int frames) {
  constexpr double kPerFrame = 0.2;  // 2 log(1 / .33) / kChi2_3_99
  constexpr double kMost = 4.0;
  return std::min(1.0 + kPerFrame * frames, kMost);
}

}  // namespace

std::vector<Vector2<double>> PointTracks::positions() const {
  std::vector<Vector2<double>> result;
  result.reserve(points_.size());
  for (const auto& point : points_) result.push_back(point.left_px);
  return result;
}

RightImageFit PointTracks::follow(const ConsecutivePyramids& pyramids, const StereoView& view,
                                  const Pose& predicted_T_previous_current,
                                  const OdometrySettings& settings) {
  std::vector<cv::Point2f> from;
  std::vector<cv::Point2f> guess;
  std::vector<PlaneView> expected;
  for (const auto& point : points_) {
    const StereoPlane plane{point.z, point.disparity_slope};
    expected.push_back(
        view_plane(plane, predicted_T_previous_current, view.camera).value_or(PlaneView{plane, {}, {}}));
    from.push_back(to_cv(point.left_px));
    guess.push_back(to_cv(view.geometry.left_position(expected.back().plane.z)));
  }
  const auto flow = track_points(pyramids.previous.left, pyramids.current.left, from, guess,
                                 {.window_px = settings.window_px, .max_level = settings.pyramid_levels - 1});
  const cv::Mat& previous_left = pyramids.previous.left.image();
  const PointMeasurement measurement{previous_left, view, settings, min_texture(previous_left),
                                     min_texture(view.frame.left)};
  std::vector<PairSearch> searches(points_.size());
  std::vector<std::uint8_t> found(points_.size());
  run_each(points_.size(), [&](std::size_t i) {
    if (!flow.found[i]) return;
    TrackedPoint& point = points_[i];
    const auto [search, measured] = measurement.measure(point.left_px, to_eigen(flow.points[i]), expected[i]);
    searches[i] = search;
    if (!measured) return;
    found[i] = 1;
    point.previous = point.z;
    point.z = measured->z;
    point.left_px = measured->left_px;
    point.R = measured->covariance_px2;
    point.disparity_slope = expected[i].plane.disparity_slope;
  });
  keep(found);
  return fit_of(searches);
}

void PointTracks::keep(const std::vector<std::uint8_t>& flags) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    if (flags[i]) points_[kept++] = points_[i];
  }
  points_.resize(kept);
}

void PointTracks::compare_with(const std::optional<Pose>& T_previous_current, const StereoCamera& camera,
                               double pixel_sigma_px) {
  // Twice: both measurements are noisy.
  const Matrix3<double> S_inverse = (2.0 * stereo_pixel_covariance(pixel_sigma_px)).inverse();
  for (auto& point : points_) {
    const int static_frames = std::exchange(point.static_frames, 0);
    if (!T_previous_current || !point.previous) continue;
    const auto expected =
        camera.project(T_previous_current->inverse() * camera.back_project(*point.previous));
    if (!expected) continue;
    const Vector3<double> error = point.z - *expected;
    if (error.dot(S_inverse * error) < kChi2_3_99) point.static_frames = static_frames + 1;
  }
}

void PointTracks::remeasure(const Remeasurement& change) {
  for (auto& point : points_) point.z = change.of(point.left_px, point.z);
  std::erase_if(points_, [](const TrackedPoint& point) { return !(point.z.z() > 0.0); });
}

void PointTracks::replenish(const StereoView& view, const std::vector<Vector2<double>>& reserved_px,
                            const Settings& settings) {
  constexpr double kFew = 0.6;  // below this share of the points wanted, corners are worth a search
  const auto& rule = settings.odometry;
  const cv::Size image = view.frame.left.size();
  const SpatialIndex reserved(reserved_px, image);
  std::erase_if(points_, [&](const TrackedPoint& point) {
    return reserved.any_within(point.left_px, rule.exclusion_px);
  });
  const int few =
      std::max(static_cast<int>(kFew * rule.max_points), std::min(rule.max_points, 2 * rule.min_inliers));
  if (static_cast<int>(points_.size()) >= few) return;

  const auto missing = static_cast<std::size_t>(rule.max_points) - points_.size();
  const int columns = (image.width + rule.cell_px - 1) / rule.cell_px;
  const int rows = (image.height + rule.cell_px - 1) / rule.cell_px;
  const CornerGrid grid{.cell_px = rule.cell_px,
                        .per_cell = 1 + rule.max_points / (columns * rows),
                        .min_distance_px = rule.exclusion_px,
                        .enough = missing / 3,
                        .fill_empty_cells = false};
  const auto corners = spread_features(detect_corners(view.frame.left, positions(), reserved_px, grid), image,
                                       rule.cell_px, missing);
  for (const auto& match : match_stereo(view, stereo_slam::positions(corners), settings.stereo)) {
    if (match)
      points_.push_back({match->z, match->left_px, match->disparity_slope, std::nullopt, std::nullopt, 0});
  }
}

std::vector<StereoCorrespondence> correspondences(const std::vector<TrackedPoint>& points) {
  std::vector<StereoCorrespondence> result;
  result.reserve(points.size());
  for (const auto& point : points)
    result.push_back({point.previous.value(), point.z, point.R, static_evidence(point.static_frames)});
  return result;
}

}  // namespace stereo_slam
