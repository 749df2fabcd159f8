// SPDX-License-Identifier: MIT
#include "stereo_slam/tracking/associate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "stereo_slam/frontend/spatial_index.hpp"

namespace stereo_slam {
namespace {

constexpr double kChi2_3_99 = 11.345;

/// Where a landmark may be in one image.
struct SearchRegion {
  Vector2<double> centre_px;
  Matrix2<double> covariance;
};

[[nodiscard]] SearchRegion left_region(const StereoPoint& z, const Matrix3<double>& S) {
  return {z.head<2>(), S.topLeftCorner<2, 2>()};
}

/// The right image sees u_right = u - d.
[[nodiscard]] SearchRegion right_region(const StereoPoint& z, const Matrix3<double>& S) {
  Eigen::Matrix<double, 2, 3> A;
  A << 1.0, 0.0, -1.0,  //
      0.0, 1.0, 0.0;
  return {A * z, A * S * A.transpose()};
}

struct Candidate {
  std::size_t feature = 0;
  int distance = std::numeric_limits<int>::max();
};

/// Feature with the most similar descriptor inside the region's 99 % ellipse.
[[nodiscard]] std::optional<Candidate> most_similar(const SearchRegion& region, const Descriptor& descriptor,
                                                    const std::vector<Feature>& features,
                                                    const SpatialIndex& index,
                                                    const AssociationSettings& settings) {
  const Matrix2<double> information = region.covariance.inverse();
  const Vector2<double> half_size = (kChi2_2_99 * region.covariance.diagonal()).cwiseSqrt();
  Candidate best;
  int second = std::numeric_limits<int>::max();
  index.for_each_in_box(region.centre_px, half_size, [&](std::size_t i) {
    const Vector2<double> e = features[i].position_px - region.centre_px;
    if (e.dot(information * e) > kChi2_2_99) return;
    const int distance = hamming_distance(descriptor, features[i].descriptor);
    if (distance < best.distance) {
      second = best.distance;
      best = {i, distance};
    } else {
      second = std::min(second, distance);
    }
  });
  if (best.distance > settings.max_descriptor_distance) return std::nullopt;
  if (best.distance > settings.descriptor_ratio * second) return std::nullopt;
  return best;
}

[[nodiscard]] std::vector<Vector2<double>> positions(const std::vector<Feature>& features) {
  std::vector<Vector2<double>> result;
  result.reserve(features.size());
  for (const auto& feature : features) result.push_back(feature.position_px);
  return result;
}

/// Whether the observed flow is that of a static point, given the predicted one.
[[nodiscard]] bool flow_agrees(const Vector2<double>& observed, const Vector2<double>& predicted,
                               double tolerance_px, double relative_tolerance) {
  return (observed - predicted).norm() <= tolerance_px + relative_tolerance * predicted.norm();
}

}  // namespace

std::vector<std::optional<LandmarkFlow>> observe_flow(const std::vector<PredictedLandmark>& predicted,
                                                      const std::vector<Landmark>& landmarks,
                                                      const Pose& T_reference_previous,
                                                      const StereoCamera& camera, const FlowPyramid& previous,
                                                      const FlowPyramid& current, int window_px) {
  std::vector<std::optional<LandmarkFlow>> flow(predicted.size());
  std::vector<std::size_t> tracked;
  std::vector<cv::Point2f> start;
  std::vector<cv::Point2f> guess;
  for (std::size_t i = 0; i < predicted.size(); ++i) {
    const Landmark& landmark = landmarks[predicted[i].index];
    const auto before = project(to_point(landmark, landmark.mean, camera), T_reference_previous, camera);
    if (!before || !camera.in_view(*before)) continue;
    tracked.push_back(i);
    start.emplace_back(static_cast<float>(before->x()), static_cast<float>(before->y()));
    guess.emplace_back(static_cast<float>(predicted[i].z.x()), static_cast<float>(predicted[i].z.y()));
  }
  const auto followed = track_points(previous, current, start, guess, {.window_px = window_px});
  for (std::size_t k = 0; k < tracked.size(); ++k) {
    if (!followed.found[k]) continue;
    flow[tracked[k]] = {Eigen::Vector2f(start[k].x, start[k].y).cast<double>(),
                        Eigen::Vector2f(followed.points[k].x, followed.points[k].y).cast<double>()};
  }
  return flow;
}

std::vector<std::optional<Vector2<double>>> gate_by_flow(
    const std::vector<PredictedLandmark>& predicted, const std::vector<std::optional<LandmarkFlow>>& observed,
    const AssociationSettings& settings) {
  std::vector<std::optional<Vector2<double>>> flow(predicted.size());
  for (std::size_t i = 0; i < predicted.size(); ++i) {
    if (!observed[i]) continue;
    const auto& [from_px, to_px] = *observed[i];
    const PredictedLandmark& p = predicted[i];
    const double spread_px = std::sqrt(kChi2_2_99 * p.pose_part.topLeftCorner<2, 2>().trace());
    if (flow_agrees(to_px - from_px, p.z.head<2>() - from_px, settings.flow_tolerance_px + spread_px,
                    settings.flow_relative_tolerance)) {
      flow[i] = to_px;
    }
  }
  return flow;
}

Matrix3<double> innovation_covariance(const PredictedLandmark& predicted,
                                      const AssociationSettings& settings) {
  return predicted.landmark_part + predicted.pose_part + stereo_pixel_covariance(settings.feature_sigma_px);
}

std::vector<Match> associate(const std::vector<PredictedLandmark>& predicted,
                             const std::vector<Landmark>& landmarks,
                             const std::vector<std::optional<Vector2<double>>>& flow,
                             const StereoFeatures& features, cv::Size image,
                             const AssociationSettings& settings) {
  const SpatialIndex left_index(positions(features.left), image);
  const SpatialIndex right_index(positions(features.right), image);
  const Matrix3<double> R = stereo_pixel_covariance(settings.feature_sigma_px);

  std::unordered_map<std::size_t, std::pair<Match, int>>
      by_feature;  // left feature -> its most similar landmark
  for (std::size_t i = 0; i < predicted.size(); ++i) {
    if (!flow[i]) continue;
    const PredictedLandmark& p = predicted[i];
    const Matrix3<double> S = innovation_covariance(p, settings);
    const Descriptor& descriptor = landmarks[p.index].descriptor;
    const auto left = most_similar(left_region(p.z, S), descriptor, features.left, left_index, settings);
    if (!left) continue;
    const auto right = most_similar(right_region(p.z, S), descriptor, features.right, right_index, settings);
    if (!right) continue;
    const Vector2<double>& at_left = features.left[left->feature].position_px;
    const Vector2<double>& at_right = features.right[right->feature].position_px;
    const StereoPoint z(at_left.x(), at_left.y(), at_left.x() - at_right.x());
    const Vector3<double> innovation = z - p.z;
    const bool coherent = std::abs(at_left.y() - at_right.y()) <= settings.max_row_error_px && z.z() > 0.0 &&
                          innovation.dot(S.llt().solve(innovation)) <= kChi2_3_99;
    if (!coherent) continue;
    const auto [known, is_new] =
        by_feature.try_emplace(left->feature, Match{p.index, z, R, p, left->feature}, left->distance);
    if (!is_new && left->distance < known->second.second) {
      known->second = {Match{p.index, z, R, p, left->feature}, left->distance};
    }
  }
  std::vector<Match> matches;
  matches.reserve(by_feature.size());
  for (auto& [feature, match] : by_feature) matches.push_back(std::move(match.first));
  std::sort(matches.begin(), matches.end(),
            [](const Match& a, const Match& b) { return a.landmark < b.landmark; });
  return matches;
}

}  // namespace stereo_slam
