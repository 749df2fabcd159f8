// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/LU>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// Displacement of the right image of one frame: what a vibration of the right camera, or another moment of
/// exposure, does to it besides the constant error of the rectification.
///
/// At the position (X, Y) of the right image, relative to the principal point and in focal lengths, it is
///
///   (u, v) += (a, b) + c (-Y, X) + d (X^2, X Y) + e (X Y, Y^2).
///
/// A rotation of the camera about its vertical axis has a = d, one about its horizontal axis b = e, and one
/// about its optical axis is c. All coefficients are in px.
struct ImageDisplacement {
  static constexpr int kTerms = 5;
  static constexpr int kSeen = 3;  ///< of them a frame measures well: a, b and c
  using Coefficients = antipode::Vector<double, kTerms>;
  using Covariance = antipode::Matrix<double, kTerms>;
  using Basis = antipode::Matrix<double, 2, kTerms>;  ///< d (u, v) / d coefficients

  [[nodiscard]] static Basis basis(const Vector2<double>& right_px, const StereoCamera& camera) {
    const double x = (right_px.x() - camera.cx) / camera.fx;
    const double y = (right_px.y() - camera.cy) / camera.fy;
    Basis result;
    result << 1.0, 0.0, -y, x * x, x * y,  //
        0.0, 1.0, x, x * y, y * y;
    return result;
  }

  /// d coefficients / d rotation of the right camera (right perturbation, camera axes), px/rad.
  [[nodiscard]] static antipode::Matrix<double, kTerms, 3> by_rotation(const StereoCamera& camera) {
    antipode::Matrix<double, kTerms, 3> result = antipode::Matrix<double, kTerms, 3>::Zero();
    result(0, 1) = result(3, 1) = result(2, 2) = -camera.fx;
    result(1, 0) = result(4, 0) = camera.fx;
    return result;
  }

  /// The rotation of the right camera with this shift and roll, rad.
  [[nodiscard]] static Vector3<double> rotation(const Coefficients& displacement,
                                                const StereoCamera& camera) {
    return Vector3<double>(displacement[1], -displacement[0], -displacement[2]) / camera.fx;
  }
};

/// An error that all disparities of a frame share, as if its right image were displaced along the rows by
/// a + d x^2, where x is the position in it relative to the principal point and in focal lengths.
struct SharedDisparityError {
  Vector2<double> displacement_px = Vector2<double>::Zero();     ///< a and d
  Matrix2<double> covariance_px2 = Matrix2<double>::Identity();  ///< of them

  /// Whether it is five standard deviations from zero.
  [[nodiscard]] bool is_clear() const {
    constexpr double kClear2 = 25.0;
    return displacement_px.dot(covariance_px2.inverse() * displacement_px) > kClear2;
  }
};

}  // namespace stereo_slam
