// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/LU>

#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

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
