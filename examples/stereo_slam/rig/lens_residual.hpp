// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// Radial distortion that rectification has left in both images, because the lenses are not exactly those of
/// the calibration: they are of one kind, and calibrated in one way.
///
/// With (x, y) the position relative to the principal point in half image widths, an exact pinhole camera
/// sees
///
///   (u, v) + (c1 r^2 + c2 r^4) (x, y),   r^2 = x^2 + y^2,
///
/// where the image shows (u, v). A coefficient is the shift in px at the middle of the left and right
/// borders.
class LensResidual {
 public:
  static constexpr int kTerms = 2;
  using Coefficients = antipode::Vector<double, kTerms>;  ///< c1, c2, px
  using Basis = antipode::Matrix<double, 2, kTerms>;      ///< d (u, v) / d coefficients

  LensResidual() = default;
  explicit LensResidual(const StereoCamera& camera, const Coefficients& coefficients = Coefficients::Zero())
      : camera_(camera), coefficients_(coefficients), is_exact_(coefficients.isZero(0.0)) {
    const double width = camera.width_px, height = camera.height_px;
    const double x = std::max(camera.cx, width - camera.cx) / (0.5 * width);
    const double y = std::max(camera.cy, height - camera.cy) / (0.5 * width * camera.fy / camera.fx);
    farthest2_ = x * x + y * y;
  }

  [[nodiscard]] const Coefficients& coefficients() const noexcept { return coefficients_; }

  /// Shift of a pixel by a unit of each coefficient. Outside the image the factor is that of its farthest
  /// corner.
  [[nodiscard]] Basis basis(const Vector2<double>& px) const {
    const double half_width = 0.5 * camera_.width_px;
    const double aspect = camera_.fy / camera_.fx;
    const double x = (px.x() - camera_.cx) / half_width;
    const double y = (px.y() - camera_.cy) / (half_width * aspect);
    const double r2 = std::min(x * x + y * y, farthest2_);
    Basis result;
    result << x * r2, x * r2 * r2,  //
        aspect * y * r2, aspect * y * r2 * r2;
    return result;
  }

  /// The same as k1 and k2 of OpenCV's inverse model: (X, Y) (1 + k1 R^2 + k2 R^4) for (X, Y) in focal
  /// lengths.
  [[nodiscard]] Vector2<double> k() const {
    const double ratio = 2.0 * camera_.fx / camera_.width_px;
    return {coefficients_[0] * ratio * ratio / (0.5 * camera_.width_px),
            coefficients_[1] * std::pow(ratio, 4) / (0.5 * camera_.width_px)};
  }

  /// Whether in_image() is the inverse of corrected() all over the image: the distortion is moderate.
  [[nodiscard]] bool is_moderate() const {
    constexpr double kLargestSlope =
        0.25;  // of the shift: an iteration of in_image() leaves a quarter of its error
    constexpr int kRadii = 20;
    const double half_width = 0.5 * camera_.width_px;
    for (int i = 1; i <= kRadii; ++i) {
      const double r2 = farthest2_ * i * i / (kRadii * kRadii);
      const double slope = (3.0 * coefficients_[0] * r2 + 5.0 * coefficients_[1] * r2 * r2) / half_width;
      if (!(std::abs(slope) < kLargestSlope)) return false;
    }
    return true;
  }

  /// Where an exact pinhole camera sees what the image shows at `px`.
  [[nodiscard]] Vector2<double> corrected(const Vector2<double>& px) const {
    return is_exact_ ? px : Vector2<double>(px + basis(px) * coefficients_);
  }

  /// The inverse of corrected().
  [[nodiscard]] Vector2<double> in_image(const Vector2<double>& corrected_px) const {
    constexpr int kIterations = 6;  // each reduces the error tenfold or more, for shifts of some px
    if (is_exact_) return corrected_px;
    Vector2<double> px = corrected_px;
    for (int i = 0; i < kIterations; ++i) px = corrected_px - basis(px) * coefficients_;
    return px;
  }

 private:
  StereoCamera camera_;
  Coefficients coefficients_ = Coefficients::Zero();  // px
  bool is_exact_ = true;
  double farthest2_ = 0.0;  // r^2 of the corner that is farthest from the principal point
};

/// What measures points without right images: the left camera with its lens.
struct LeftCamera {
  const StereoCamera& camera;
  LensResidual lens;
  Matrix2<double> lens_covariance_px2 = Matrix2<double>::Zero();  ///< of its coefficients
};

}  // namespace stereo_slam
