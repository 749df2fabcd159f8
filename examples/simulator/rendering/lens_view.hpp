// SPDX-License-Identifier: MIT
#pragma once

#include <optional>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "simulator/rendering/projection.hpp"
#include "stereo_slam/calibration/stereo_rig.hpp"

namespace stereo_slam::simulator {

/// The ray (X/Z, Y/Z) of a pixel: the inverse of the formulas of Distortion, by Newton's method or
/// fixed-point iteration. Empty if there is no such ray within 85 degrees of the optical axis.
[[nodiscard]] std::optional<Eigen::Vector2d> ray_of_pixel(const Lens& lens, double u, double v);

/// Warps the pinhole image that the renderer draws into the image of a lens.
class LensView {
 public:
  /// Throws std::invalid_argument when pixels of the image have no ray.
  explicit LensView(const Lens& lens);

  /// The camera to render with: same direction, covers the view of the lens at no lower resolution.
  [[nodiscard]] const PinholeCamera& pinhole() const noexcept { return pinhole_; }

  /// The image of the lens from that of pinhole(); every pixel is the mean of four points.
  [[nodiscard]] cv::Mat1f through(const cv::Mat1f& pinhole_light) const;

 private:
  cv::Size size_;
  PinholeCamera pinhole_;
  cv::Mat2f positions_;  ///< in the pinhole image, of two by two points a pixel
};

/// A rig similar to EuRoC's, with a baseline of 0.3 m, axes slightly off parallel and the given distortion.
/// `scale` is the share of 752x480 pixels. Throws std::invalid_argument for kNone.
[[nodiscard]] StereoRig euroc_like_rig(Distortion distortion, double scale = 1.0);

}  // namespace stereo_slam::simulator
