// SPDX-License-Identifier: MIT
#include "stereo_slam/local_map/local_map.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>

#include <Eigen/LU>

#include <antipode/filters/unscented_update.hpp>
#include <antipode/sampling/pose_rules.hpp>

#include "stereo_slam/local_map/landmark.hpp"

namespace stereo_slam {
namespace {

constexpr int kEstablished = 3;  // observations after which a landmark is kept for the map

/// How far a patch can be believed to show a single surface: the correlation, less one if the point is near
/// and its disparity has the slope of no common surface. At a small depth another surface in the patch,
/// behind the upper edge of a car say, soon moves by several tenths of a pixel relative to the point.
[[nodiscard]] double clarity(const StereoMeasurement& measured, const StereoCamera& camera) {
  constexpr double kNear_baselines = 60.0;
  const bool near = measured.z.z() > camera.fx / kNear_baselines;
  return measured.correlation - (near && !measured.on_common_surface ? 1.0 : 0.0);
}

/// The smallest clarity that a new landmark needs.
[[nodiscard]] double required_clarity(const StereoPoints& points, const StereoCamera& camera,
                                      const MapSettings& settings) {
  constexpr double kNone = -2.0;
  const auto enough = static_cast<std::size_t>(settings.max_new_landmarks / 2);
  if (points.measured.size() <= enough || settings.clear_correlation <= -1.0) return kNone;
  std::vector<double> clarities;
  for (const auto& measured : points.measured) clarities.push_back(clarity(measured, camera));
  const auto last = clarities.begin() + static_cast<std::ptrdiff_t>(enough);
  std::nth_element(clarities.begin(), last, clarities.end(), std::greater<>());
  return std::min(*last, settings.clear_correlation);
}

[[nodiscard]] std::uint8_t intensity_at(const cv::Mat& image, const Vector2<double>& px) {
  const int x = std::clamp(static_cast<int>(std::lround(px.x())), 0, image.cols - 1);
  const int y = std::clamp(static_cast<int>(std::lround(px.y())), 0, image.rows - 1);
  return image.at<std::uint8_t>(y, x);
}

}  // namespace

void LocalMap::add(const StereoPoints& points, const std::vector<std::uint32_t>& ids,
                   const PoseGaussian& T_keyframe_camera, const StereoFrame& frame) {
  const double min_disparity_px = camera_.fx / settings_.max_baselines;
  const Matrix3<double> least = stereo_pixel_covariance(settings_.pixel_sigma_px);
  const double min_clarity = required_clarity(points, camera_, settings_);
  for (std::size_t i = 0; i < points.measured.size(); ++i) {
    const StereoPoint& z = points.measured[i].z;
    if (z.z() < min_disparity_px || clarity(points.measured[i], camera_) < min_clarity) continue;
    const Matrix3<double> R = least + points.measured[i].covariance_px2;
    Landmark landmark;
    landmark.id = ids[i];
    landmark.T_reference_anchor = T_keyframe_camera.pose;
    landmark.anchor_px = landmark.last_px = points.measured[i].left_px;
    landmark.disparity_slope = points.measured[i].disparity_slope;
    if (!points.descriptors.empty()) landmark.descriptor = points.descriptors[i];
    landmark.last_seen = frame.index;
    landmark.intensity = intensity_at(frame.left, landmark.anchor_px);
    landmark.mean = z;
    const auto J = pose_jacobian(to_point(landmark, z, camera_), T_keyframe_camera.pose, camera_);
    landmark.covariance = R + J * T_keyframe_camera.covariance * J.transpose();
    landmarks_.push_back(landmark);
  }
}

void LocalMap::remeasure(const Remeasurement& change) {
  std::erase_if(landmarks_, [&](Landmark& landmark) {
    const StereoPoint now = change.of(landmark.anchor_px, landmark.mean);
    if (!(now.z() > 0.0)) return true;
    const double factor = now.z() / landmark.mean.z();  // of the standard deviation, about
    landmark.mean = now;
    landmark.covariance.row(2) *= factor;
    landmark.covariance.col(2) *= factor;
    return false;
  });
}

std::vector<Vector2<double>> LocalMap::observed_in(std::size_t frame) const {
  std::vector<Vector2<double>> positions_px;
  for (const auto& landmark : landmarks_) {
    if (landmark.last_seen == frame) positions_px.push_back(landmark.last_px);
  }
  return positions_px;
}

void LocalMap::record_observations(const std::vector<Match>& matches,
                                   const std::vector<Feature>& left_features, std::size_t frame) {
  for (const auto& match : matches) {
    Landmark& landmark = landmarks_[match.landmark];
    landmark.last_px = match.left_px;
    landmark.last_seen = frame;
    ++landmark.observations;
    if (match.left_feature) landmark.descriptor = left_features[*match.left_feature].descriptor;
  }
}

void LocalMap::update(const std::vector<Match>& matches, const PoseDensity& T_keyframe_camera) {
  const auto poses = antipode::sample(antipode::PaperPoseRule{}, T_keyframe_camera);
  for (const auto& match : matches) {
    Landmark& landmark = landmarks_[match.landmark];
    const auto measure = [&](const Pose& pose, const Vector3<double>& l) {
      return project(to_point(landmark, l, camera_), pose, camera_);
    };
    const antipode::Gaussian<double, 3> prior(landmark.mean, landmark.covariance);
    const auto updated = antipode::unscented_update(prior, poses, measure, {match.z, match.R});
    if (updated.status != antipode::UnscentedUpdateStatus::kUpdated) continue;
    landmark.mean = updated.posterior.mean();
    landmark.covariance = updated.posterior.covariance();
  }
}

void LocalMap::predict_correlation(const Matrix6<double>& pose_regression) {
  for (auto& landmark : landmarks_)
    landmark.pose_cross_covariance = (pose_regression * landmark.pose_cross_covariance).eval();
}

void LocalMap::update_correlation(const PoseGaussian& prior, const Pose& posterior,
                                  const std::vector<Match>& matches) {
  // Innovations have the covariance S = D + U M U^T: D block-diagonal, U = [H, J B^T] with the Jacobians H of
  // the pose and J of the landmark and B = pose_cross_covariance, M = [P I; I 0]. Woodbury's identity leaves
  // a 12 x 12 system, and the gain is K = [I 0] (M^-1 + U^T D^-1 U)^-1 U^T D^-1. Matrices are so small that
  // lazyProduct() is faster than the product by blocks that Eigen would choose.
  using Matrix12 = antipode::Matrix<double, 12>;
  using Matrix12x3 = antipode::Matrix<double, 12, 3>;
  std::vector<Matrix12x3> weighted;  // U^T D^-1 of each match
  std::vector<Matrix3<double>> J_landmark;
  Matrix12 information = Matrix12::Zero();
  weighted.reserve(matches.size());
  J_landmark.reserve(matches.size());
  for (const auto& match : matches) {
    const Landmark& landmark = landmarks_[match.landmark];
    J_landmark.push_back(landmark_jacobian(landmark, posterior, camera_));
    antipode::Matrix<double, 3, 12> U;
    U << pose_jacobian(to_point(landmark, landmark.mean, camera_), posterior, camera_),
        J_landmark.back() * landmark.pose_cross_covariance.transpose();
    const Matrix3<double> S = match.predicted.landmark_part + match.R;
    weighted.push_back(U.transpose().lazyProduct(S.inverse()));
    information += weighted.back().lazyProduct(U);
  }
  Matrix12 system = information;
  system.topRightCorner<6, 6>() += Matrix6<double>::Identity();
  system.bottomLeftCorner<6, 6>() += Matrix6<double>::Identity();
  system.bottomRightCorner<6, 6>() -= prior.covariance;
  const antipode::Matrix<double, 6, 12> X = system.partialPivLu().inverse().topRows<6>();
  const Matrix6<double> KH = X * information.leftCols<6>();
  for (auto& landmark : landmarks_)
    landmark.pose_cross_covariance -= (KH * landmark.pose_cross_covariance).eval();
  for (std::size_t i = 0; i < matches.size(); ++i) {
    Landmark& landmark = landmarks_[matches[i].landmark];
    const antipode::Matrix<double, 6, 3> gain = X.lazyProduct(weighted[i]);
    landmark.pose_cross_covariance -= gain * (J_landmark[i] * landmark.covariance);
  }
}

void LocalMap::cull(std::size_t frame) {
  const auto stale = [&](const Landmark& landmark) {
    return frame > landmark.last_seen + static_cast<std::size_t>(settings_.cull_after_frames);
  };
  for (const auto& landmark : landmarks_) {
    if (stale(landmark)) move_to_archive(landmark);
  }
  std::erase_if(landmarks_, stale);
}

void LocalMap::restart(std::size_t keyframe) {
  for (const auto& landmark : landmarks_) move_to_archive(landmark);
  landmarks_.clear();
  keyframe_ = keyframe;
}

std::optional<ArchivedPoint> LocalMap::archived(const Landmark& landmark) const {
  const HomogeneousPoint point = to_point(landmark, landmark.mean, camera_);
  if (landmark.observations < kEstablished || point.w <= 0.0) return std::nullopt;
  return ArchivedPoint{keyframe_, landmark.id, point.x / point.w, landmark.intensity};
}

void LocalMap::move_to_archive(const Landmark& landmark) {
  if (const auto point = archived(landmark)) archive_.push_back(*point);
}

std::vector<ArchivedPoint> LocalMap::established() const {
  std::vector<ArchivedPoint> points;
  for (const auto& landmark : landmarks_) {
    if (const auto point = archived(landmark)) points.push_back(*point);
  }
  return points;
}

}  // namespace stereo_slam
