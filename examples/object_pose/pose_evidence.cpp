// SPDX-License-Identifier: MIT
#include "pose_evidence.hpp"

#include <cmath>
#include <vector>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include <antipode/distributions/bingham_gaussian.hpp>
#include <antipode/distributions/projected_gaussian_conversions.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/geometry/quaternion.hpp>

namespace object_pose {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kRingElements = 6;

/// The orientation of a feature as a function of its surface's tilt, given the line of sight and SIFT's
/// orientation.
class SightLine {
 public:
  SightLine(const SeenFeature& seen, const StereoCamera& camera)
      : place_(camera.back_project(seen.z)),
        to_image_(camera.projection_jacobian(place_).topRows<2>()),
        gradient_(std::cos(seen.angle_rad), std::sin(seen.angle_rad)),
        R_camera_sight_(Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), place_)) {}

  [[nodiscard]] const Vector3d& place() const { return place_; }
  [[nodiscard]] Vector3d direction() const { return place_.normalized(); }

  /// The feature's axes (R_camera_feature) if its surface is tilted by a rotation vector [rad] across the
  /// line of sight.
  ///
  /// The image shows the surface through an affine map A. Gradients are covectors: the model's gradient,
  /// which is along the feature's x axis, appears along A^-T (1, 0). With A = A_0 Rot(roll) this is the
  /// gradient that SIFT saw if (cos roll, sin roll) ~ A_0^T gradient.
  [[nodiscard]] Matrix3d axes(const Vector2d& tilt) const {
    const Matrix3d R = tilted(tilt);
    const Vector2d x = (to_image_ * R.leftCols<2>()).transpose() * gradient_;
    return R * Eigen::AngleAxisd(std::atan2(x.y(), x.x()), Vector3d::UnitZ());
  }

  /// The scale at which the tilted surface appears [px/m], as the geometric mean over all directions.
  [[nodiscard]] double magnification(const Vector2d& tilt) const {
    return std::sqrt(std::abs(Matrix2d(to_image_ * tilted(tilt).leftCols<2>()).determinant()));
  }

 private:
  [[nodiscard]] Matrix3d tilted(const Vector2d& tilt) const {
    const Vector3d phi(tilt.x(), tilt.y(), 0.0);
    return (R_camera_sight_ * antipode::to_eigen(antipode::quaternion_exp(phi))).toRotationMatrix();
  }

  Vector3d place_;
  Eigen::Matrix<double, 2, 3> to_image_;
  Vector2d gradient_;
  Eigen::Quaterniond R_camera_sight_;
};

Matrix3d place_covariance(const SeenFeature& seen, const StereoCamera& camera, const EvidenceSettings& s) {
  const double alone_px = std::hypot(s.stereo_sigma_px, s.stereo_sigma_per_diameter * seen.diameter_px);
  const double common_px = std::hypot(s.place_sigma_px, s.place_sigma_per_diameter * seen.diameter_px);
  Matrix3d S = stereo_slam::stereo_pixel_covariance(alone_px);
  S.topLeftCorner<2, 2>() += common_px * common_px * Matrix2d::Identity();
  const Matrix3d J = camera.back_projection_jacobian(seen.z);
  return J * S * J.transpose();
}

/// The covariance of the rotation vector in the feature's frame [rad^2]: the tilt about both axes, with the
/// roll that follows from it, and SIFT's error about the line of sight.
Matrix3d rotation_covariance(const SightLine& sight, const Vector2d& tilt, const EvidenceSettings& s) {
  constexpr double kStep_rad = 1e-4;
  const Matrix3d Rt = sight.axes(tilt).transpose();
  Matrix3d root;
  for (int i = 0; i < 2; ++i) {
    const Matrix3d turned = Rt * sight.axes(tilt + kStep_rad * Vector2d::Unit(i));
    const auto q = antipode::quaternion_from_rotation_matrix(turned);
    root.col(i) = antipode::quaternion_log(q) / kStep_rad * s.tilt_sigma_rad;
  }
  root.col(2) = Rt * sight.direction() * s.roll_sigma_rad;
  return root * root.transpose();
}

Component base_element(const SightLine& sight, const Vector2d& tilt, const Matrix3d& place_covariance_m2,
                       const EvidenceSettings& settings) {
  antipode::Matrix6<double> Sigma = antipode::Matrix6<double>::Zero();
  Sigma.topLeftCorner<3, 3>() = 0.25 * rotation_covariance(sight, tilt, settings);  // u is half of phi
  Sigma.bottomRightCorner<3, 3>() = place_covariance_m2;
  return {Pose::from_matrix(sight.axes(tilt), sight.place()), Sigma};
}

}  // namespace

Belief feature_pose(const SeenFeature& seen, double diameter_m, const StereoCamera& camera,
                    const EvidenceSettings& settings) {
  const SightLine sight(seen, camera);
  const Matrix3d place_covariance_m2 = place_covariance(seen, camera, settings);
  std::vector<Belief::Element> elements;
  const auto add = [&](const Vector2d& tilt) {
    const double surprise =
        std::log(seen.diameter_px / (diameter_m * sight.magnification(tilt))) / settings.log_scale_sigma;
    elements.push_back(
        {std::exp(-0.5 * surprise * surprise), base_element(sight, tilt, place_covariance_m2, settings)});
  };
  add(Vector2d::Zero());
  for (int k = 0; k < kRingElements; ++k) {
    const double angle = 2.0 * std::numbers::pi * k / kRingElements;
    add(settings.ring_rad * Vector2d(std::cos(angle), std::sin(angle)));
  }
  return Belief::normalized(std::move(elements));
}

Belief compose_with_lever(const Belief& x, const Pose& y) {
  std::vector<Belief::Element> elements;
  for (const auto& [weight, density] : x) {
    const auto moved = compose(antipode::to_bingham_gaussian(density), y);
    elements.push_back({weight, antipode::to_projected_gaussian(moved)});
  }
  return Belief::normalized(std::move(elements));
}

FeatureEvidence evidence_of(const Match& match, const FeatureModel& model, const StereoCamera& camera,
                            const EvidenceSettings& settings) {
  const ModelFeature& feature = model.features[match.model_feature];
  const Belief T_camera_feature = feature_pose(match.seen, feature.diameter_m, camera, settings);
  return {T_camera_feature, feature.T_object_feature,
          compose_with_lever(T_camera_feature, feature.T_object_feature.inverse())};
}

}  // namespace object_pose
