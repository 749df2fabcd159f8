// SPDX-License-Identifier: MIT
#pragma once

#include <optional>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "simulator/rendering/projection.hpp"
#include "stereo_slam/dataset/stereo_rig.hpp"

namespace stereo_slam::simulator {

/// The ray (X/Z, Y/Z) that a lens shows at a pixel: the inverse of the formulas of Distortion, by Newton's
/// method or fixed-point iteration. Nothing where there is none within 85 degrees of the axis.
[[nodiscard]] std::optional<Eigen::Vector2d> ray_of_pixel(const Lens& lens, double u, double v);

/// Makes the image of a lens out of that of a pinhole, which is what the renderer draws.
class LensView {
 public:
  /// Throws std::invalid_argument when parts of the image see nothing.
  explicit LensView(const Lens& lens);

  /// To render with: looks the same way, sees all that the lens sees, no coarser than it anywhere.
  [[nodiscard]] const PinholeCamera& pinhole() const noexcept { return pinhole_; }

  /// The light behind the lens; every pixel is the mean of four points.
  [[nodiscard]] cv::Mat1f through(const cv::Mat1f& pinhole_light) const;

 private:
  cv::Size size_;
  PinholeCamera pinhole_;
  cv::Mat2f positions_;  ///< in the pinhole image, of two by two points a pixel
};

/// Two cameras much like EuRoC's, 0.3 m apart and not quite parallel, with distortion of a model. `scale` is
/// the share of 752x480 pixels. Throws std::invalid_argument for kNone.
[[nodiscard]] StereoRig euroc_like_rig(Distortion distortion, double scale = 1.0);

}  // namespace stereo_slam::simulator
