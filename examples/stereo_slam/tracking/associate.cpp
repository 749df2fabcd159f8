// SPDX-License-Identifier: MIT
#include "stereo_slam/tracking/associate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "stereo_slam/core/chi_square.hpp"
#include "stereo_slam/core/descriptor.hpp"
#include "stereo_slam/core/opencv_points.hpp"
#include "stereo_slam/frontend/spatial_index.hpp"

namespace stereo_slam {
namespace {

constexpr int kMaxDescriptorDistance = 64;  // bits of 256, of a match
constexpr double kDescriptorRatio = 0.9;    // largest, of best to second-best distance in the search region
constexpr int kFlowWindow_px = 15;          // side of the optical-flow window
constexpr double kFlowRelativeTolerance = 0.2;  // of the flow gate, as a fraction of the length of the flow

/// Expected position of a landmark in one image.
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

/// Features of one image, searched by position.
class FeatureImage {
 public:
  FeatureImage(const std::vector<Feature>& features, cv::Size image)
      : features_(features), index_(positions(features), image) {}

  /// Feature with the most similar descriptor inside the region's 99 % ellipse.
  [[nodiscard]] std::optional<Candidate> most_similar(const SearchRegion& region,
                                                      const Descriptor& descriptor) const {
    const Matrix2<double> information = region.covariance.inverse();
    const Vector2<double> half_size = (kChi2_2_99 * region.covariance.diagonal()).cwiseSqrt();
    Candidate best;
    int second = std::numeric_limits<int>::max();
    index_.for_each_in_box(region.centre_px, half_size, [&](std::size_t i) {
      const Vector2<double> e = features_[i].position_px - region.centre_px;
      if (e.dot(information * e) > kChi2_2_99) return;
      const int distance = hamming_distance(descriptor, features_[i].descriptor);
      if (distance < best.distance) {
        second = best.distance;
        best = {i, distance};
      } else {
        second = std::min(second, distance);
      }
    });
    if (best.distance > kMaxDescriptorDistance) return std::nullopt;
    if (best.distance > kDescriptorRatio * second) return std::nullopt;
    return best;
  }

 private:
  const std::vector<Feature>& features_;
  SpatialIndex index_;
};

/// A match and the distance of its descriptors, bits.
struct FeatureMatch {
  Match match;
  int distance = 0;
};

/// Search for the features of landmarks in both images of a frame.
class FeatureSearch {
 public:
  FeatureSearch(const StereoFeatures& features, cv::Size image, const AssociationSettings& settings)
      : features_(features),
        left_(features.left, image),
        right_(features.right, image),
        settings_(settings) {}

  /// The pair of features most similar to the landmark, if it satisfies the epipolar constraint and is near
  /// the prediction.
  [[nodiscard]] std::optional<FeatureMatch> match(const PredictedLandmark& p,
                                                  const Descriptor& descriptor) const {
    const Matrix3<double> S = innovation_covariance(p, settings_);
    const auto left = left_.most_similar(left_region(p.z, S), descriptor);
    if (!left) return std::nullopt;
    const auto right = right_.most_similar(right_region(p.z, S), descriptor);
    if (!right) return std::nullopt;
    const Vector2<double>& at_left = features_.left[left->feature].position_px;
    const Vector2<double>& at_right = features_.right[right->feature].position_px;
    const StereoPoint z(at_left.x(), at_left.y(), at_left.x() - at_right.x());
    const Vector3<double> innovation = z - p.z;
    const bool coherent = std::abs(at_left.y() - at_right.y()) <= settings_.max_row_error_px && z.z() > 0.0 &&
                          innovation.dot(S.llt().solve(innovation)) <= kChi2_3_99;
    if (!coherent) return std::nullopt;
    const Matrix3<double> R = stereo_pixel_covariance(settings_.feature_sigma_px);
    return FeatureMatch{Match{.landmark = p.index,
                              .z = z,
                              .left_px = at_left,
                              .R = R,
                              .predicted = p,
                              .left_feature = left->feature},
                        left->distance};
  }

 private:
  const StereoFeatures& features_;
  FeatureImage left_;
  FeatureImage right_;
  const AssociationSettings& settings_;
};

/// Whether the observed flow is that of a static point, given the predicted one.
[[nodiscard]] bool flow_agrees(const Vector2<double>& observed, const Vector2<double>& predicted,
                               double tolerance_px, double relative_tolerance) {
  return (observed - predicted).norm() <= tolerance_px + relative_tolerance * predicted.norm();
}

}  // namespace

Association expect_landmarks(const MapView& map, const PoseGaussian& T_keyframe_camera,
                             const LensResidual& lens, const MapSettings& settings) {
  Association association;
  association.predicted = project_landmarks(map, T_keyframe_camera, settings.max_baselines);
  for (const auto& landmark : association.predicted)
    association.search_start_px.emplace_back(lens.in_image(landmark.z.head<2>()));
  return association;
}

std::vector<std::optional<LandmarkFlow>> observe_flow(const std::vector<PredictedLandmark>& predicted,
                                                      const MapView& map, const Pose& T_keyframe_previous,
                                                      const ConsecutivePyramids& pyramids,
                                                      const LensResidual& lens) {
  std::vector<std::optional<LandmarkFlow>> flow(predicted.size());
  std::vector<std::size_t> tracked;
  std::vector<cv::Point2f> start;
  std::vector<cv::Point2f> guess;
  for (std::size_t i = 0; i < predicted.size(); ++i) {
    const Landmark& landmark = map.landmarks[predicted[i].index];
    const auto before =
        project(to_point(landmark, landmark.mean, map.camera), T_keyframe_previous, map.camera);
    if (!before || !map.camera.in_view(*before)) continue;
    tracked.push_back(i);
    start.push_back(to_cv(lens.in_image(before->head<2>())));
    guess.push_back(to_cv(lens.in_image(predicted[i].z.head<2>())));
  }
  const auto followed = track_points(pyramids.previous.left, pyramids.current.left, start, guess,
                                     {.window_px = kFlowWindow_px});
  for (std::size_t k = 0; k < tracked.size(); ++k) {
    if (!followed.found[k]) continue;
    flow[tracked[k]] = {to_eigen(start[k]), to_eigen(followed.points[k])};
  }
  return flow;
}

std::vector<std::optional<Vector2<double>>> gate_by_flow(const std::vector<PredictedLandmark>& predicted,
                                                         const std::vector<std::optional<LandmarkFlow>>& flow,
                                                         const LensResidual& lens,
                                                         const AssociationSettings& settings) {
  std::vector<std::optional<Vector2<double>>> search_start_px(predicted.size());
  for (std::size_t i = 0; i < predicted.size(); ++i) {
    if (!flow[i]) continue;
    const auto& [from_px, to_px] = *flow[i];
    const PredictedLandmark& p = predicted[i];
    const double spread_px = std::sqrt(kChi2_2_99 * p.pose_part.topLeftCorner<2, 2>().trace());
    if (flow_agrees(to_px - from_px, lens.in_image(p.z.head<2>()) - from_px,
                    settings.flow_tolerance_px + spread_px, kFlowRelativeTolerance)) {
      search_start_px[i] = to_px;
    }
  }
  return search_start_px;
}

Matrix3<double> innovation_covariance(const PredictedLandmark& predicted,
                                      const AssociationSettings& settings) {
  return predicted.landmark_part + predicted.pose_part + stereo_pixel_covariance(settings.feature_sigma_px);
}

std::vector<Match> associate(const std::vector<PredictedLandmark>& predicted,
                             const std::vector<std::optional<Vector2<double>>>& search_start_px,
                             const MapView& map, const StereoFeatures& features,
                             const AssociationSettings& settings) {
  const FeatureSearch search(features, {map.camera.width_px, map.camera.height_px}, settings);
  std::unordered_map<std::size_t, FeatureMatch> by_feature;  // left feature -> its most similar landmark
  for (std::size_t i = 0; i < predicted.size(); ++i) {
    if (!search_start_px[i]) continue;
    const auto found = search.match(predicted[i], map.landmarks[predicted[i].index].descriptor);
    if (!found) continue;
    const auto [known, is_new] = by_feature.try_emplace(*found->match.left_feature, *found);
    if (!is_new && found->distance < known->second.distance) known->second = *found;
  }
  std::vector<Match> matches;
  matches.reserve(by_feature.size());
  for (auto& [feature, found] : by_feature) matches.push_back(std::move(found.match));
  std::sort(matches.begin(), matches.end(),
            [](const Match& a, const Match& b) { return a.landmark < b.landmark; });
  return matches;
}

AssociationTrace trace_association(const Association& association,
                                   const std::vector<Vector2<double>>& odometry_px,
                                   const AssociationSettings& settings) {
  std::unordered_map<std::size_t, Vector2<double>> matched_px;  // by landmark
  for (const auto& match : association.matches) matched_px.emplace(match.landmark, match.left_px);

  AssociationTrace trace;
  trace.odometry_px = odometry_px;
  for (std::size_t i = 0; i < association.predicted.size(); ++i) {
    TracedLandmark landmark;
    const PredictedLandmark& predicted = association.predicted[i];
    landmark.predicted_px = predicted.z.head<2>();
    landmark.flow = association.flow[i];
    landmark.static_flow = association.search_start_px[i].has_value();
    landmark.search_covariance_px2 = innovation_covariance(predicted, settings).topLeftCorner<2, 2>();
    const auto match = matched_px.find(predicted.index);
    if (match != matched_px.end()) landmark.matched_px = match->second;
    trace.landmarks.push_back(landmark);
  }
  return trace;
}

}  // namespace stereo_slam
