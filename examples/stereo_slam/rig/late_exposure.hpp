// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>

#include <antipode/geometry/quaternion.hpp>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// The stereo geometry of a frame whose right image was exposed later than the left one, while the rig moved
/// by T_left_later. The right camera is at T_left_later * (baseline, 0, 0) then. It sees the point with the
/// disparity d, which lies on the ray r = ((u - cx) / fx, (v - cy) / fy, 1) of the left camera, in the
/// direction
///
///   q = R' r - d / fx s,   s = R' t / baseline + (1, 0, 0),
///
/// where R and t are rotation and translation of T_left_later. Cameras are exact here: see
/// PairGeometry for the errors that rectification leaves.
class LateExposure {
 public:
  /// A point in the right image, seen from the left one.
  struct Seen {
    double disparity_px = 0.0;      ///< fx baseline / Z in the left camera; 0 where no disparity can be told
    double row_error_px = 0.0;      ///< expected minus measured row in the right image
    double disparity_per_px = 1.0;  ///< change of the disparity by a pixel along the row of the right image
  };

  /// Both images at once.
  LateExposure() = default;
  LateExposure(const StereoCamera& camera, const Pose& T_left_later)
      : camera_(camera),
        R_(T_left_later.rotation_matrix().transpose()),
        step_(R_ * T_left_later.translation() / camera.baseline_m + Vector3<double>::UnitX()),
        is_late_(true) {}

  /// Whether there is a motion between both exposures.
  [[nodiscard]] bool is_late() const noexcept { return is_late_; }

  /// The same if the rig has turned further, by a rotation in the axes that it had then.
  [[nodiscard]] LateExposure turned(const Vector3<double>& rad) const {
    const Matrix3<double> R = antipode::rotation_matrix(antipode::quaternion_exp(rad)).transpose();
    LateExposure result = *this;
    result.R_ = R * R_;
    result.step_ = R * (step_ - Vector3<double>::UnitX()) + Vector3<double>::UnitX();
    return result;
  }

  /// Where the right camera sees the point that the left one sees at `left_px`, px.
  [[nodiscard]] Vector2<double> right_position(const Vector2<double>& left_px, double disparity_px) const {
    if (!is_late_) return left_px - Vector2<double>(disparity_px, 0.0);
    return to_pixels(direction(left_px, disparity_px));
  }

  /// The disparity of the point that the cameras see at `left_px` and `right_px`: that which explains the
  /// column in the right image. None is told where the right camera has moved nearly towards the point.
  [[nodiscard]] Seen measure(const Vector2<double>& left_px, const Vector2<double>& right_px) const {
    const Vector2<double> at_once = left_px - right_px;
    if (!is_late_) return {at_once.x(), at_once.y()};
    const Vector3<double> ray = direction(left_px, 0.0);
    const double X = (right_px.x() - camera_.cx) / camera_.fx;
    const double across = step_.x() - X * step_.z();
    if (!(across > kLeastBaseline)) return {};
    const double disparity_px = camera_.fx * (ray.x() - X * ray.z()) / across;
    const Vector3<double> seen = direction(left_px, disparity_px);
    return {disparity_px, to_pixels(seen).y() - right_px.y(), seen.z() / across};
  }

  /// d (disparity, row error) / d translation of T_left_later, for a point measured so, px/m.
  [[nodiscard]] Eigen::Matrix<double, 2, 3> by_step(const Vector2<double>& left_px,
                                                    double disparity_px) const {
    const Vector3<double> q = direction(left_px, disparity_px);
    const double z = std::max(q.z(), kNearest);
    const Vector2<double> x = q.head<2>() / z;
    const double across = std::max(step_.x() - x.x() * step_.z(), kLeastBaseline);
    const Matrix3<double> R = R_ * (disparity_px / camera_.baseline_m);
    Eigen::Matrix<double, 2, 3> result;
    result.row(0) = (x.x() * R.row(2) - R.row(0)) / across;
    const Matrix3<double> by_q = -(R + step_ * result.row(0)) * (camera_.fy / camera_.fx / z);
    result.row(1) = by_q.row(1) - x.y() * by_q.row(2);
    return result;
  }

  /// d right position / d left position on a surface whose disparity changes by `slope` with the position.
  [[nodiscard]] Matrix2<double> warp(const Vector2<double>& left_px, double disparity_px,
                                     const Vector2<double>& slope) const {
    Matrix2<double> result = Matrix2<double>::Identity();
    result.row(0) -= slope.transpose();
    if (!is_late_) return result;
    const Vector3<double> q = direction(left_px, disparity_px);
    const double z = std::max(q.z(), kNearest);
    for (int i = 0; i < 2; ++i) {
      const Vector3<double> dq =
          R_.col(i) / (i == 0 ? camera_.fx : camera_.fy) - slope[i] / camera_.fx * step_;
      result.col(i) = (dq.head<2>() - q.head<2>() * (dq.z() / z)) / z;
    }
    result.row(0) *= camera_.fx;
    result.row(1) *= camera_.fy;
    return result;
  }

 private:
  static constexpr double kLeastBaseline = 0.2;  // across the ray, relative to the usual one
  static constexpr double kNearest = 0.05;  // a point behind the right camera is far outside of its image

  /// Of the point in the axes of the right camera; its z is 1 where that has not moved ahead.
  [[nodiscard]] Vector3<double> direction(const Vector2<double>& left_px, double disparity_px) const {
    const Vector3<double> ray((left_px.x() - camera_.cx) / camera_.fx,
                              (left_px.y() - camera_.cy) / camera_.fy, 1.0);
    return R_ * ray - disparity_px / camera_.fx * step_;
  }
  [[nodiscard]] Vector2<double> to_pixels(const Vector3<double>& direction) const {
    const double z = std::max(direction.z(), kNearest);
    return {camera_.fx * direction.x() / z + camera_.cx, camera_.fy * direction.y() / z + camera_.cy};
  }

  StereoCamera camera_;
  Matrix3<double> R_ = Matrix3<double>::Identity();  // R_later_left
  Vector3<double> step_ = Vector3<double>::UnitX();  // from left to right camera, in baselines
  bool is_late_ = false;
};

}  // namespace stereo_slam
