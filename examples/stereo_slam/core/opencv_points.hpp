// SPDX-License-Identifier: MIT
#pragma once

#include <opencv2/core/types.hpp>

#include <antipode/eigen_types.hpp>

/// Conversion of image points between OpenCV and Eigen.
namespace stereo_slam {

[[nodiscard]] inline cv::Point2f to_cv(const antipode::Vector2<double>& p) {
  return {static_cast<float>(p.x()), static_cast<float>(p.y())};
}

[[nodiscard]] inline antipode::Vector2<double> to_eigen(const cv::Point2f& p) { return {p.x, p.y}; }

}  // namespace stereo_slam
