// SPDX-License-Identifier: MIT
#pragma once

#include <span>

#include <Eigen/Core>

#include "stereo_slam/core/corner_pairs.hpp"
#include "stereo_slam/core/robust_line.hpp"
#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/rig/image_displacement.hpp"
#include "stereo_slam/rig/late_exposure.hpp"
#include "stereo_slam/rig/lens_residual.hpp"
#include "stereo_slam/rig/stereo_measurement.hpp"

namespace stereo_slam {

/// How the two images of a pair show a point: what their rectification has left is a smooth offset of the
/// right image,
///
///   (u_right, v_right) = (u - d, v) + C (1, x, y, x^2, x y, y^2, x^3, x^2 y, x y^2, y^3)',
///
/// where (x, y) is the left position relative to the principal point and in half image sizes, so that a
/// coefficient is an offset in pixels at the border. The offset is zero for a perfect calibration; small
/// errors of the relative rotation or a difference of the lenses cause it. An offset of a fraction of a pixel
/// in u changes the length of the estimated path by several per cent. The error that both lenses have is a
/// LensResidual: a measurement z is what exact pinhole cameras would measure. The right image of a single
/// frame may be displaced in addition, and exposed later than the left one (LateExposure).
class PairGeometry {
 public:
  static constexpr int kTerms = 10;
  using Basis = antipode::Vector<double, kTerms>;
  using Coefficients = antipode::Matrix<double, 2, kTerms>;  ///< px; rows u, v

  PairGeometry() = default;
  explicit PairGeometry(const StereoCamera& camera, const Coefficients& coefficients = Coefficients::Zero(),
                        const LensResidual::Coefficients& lens = LensResidual::Coefficients::Zero())
      : camera_(camera), coefficients_(coefficients), lens_(camera, lens) {}

  /// The terms (1, x, y, ...) at a position in the left image.
  [[nodiscard]] Basis basis(const Vector2<double>& left_px) const;
  [[nodiscard]] const Coefficients& coefficients() const noexcept { return coefficients_; }

  /// The same for a frame whose right image is displaced in addition.
  [[nodiscard]] PairGeometry displaced(const ImageDisplacement::Coefficients& displacement) const {
    PairGeometry result = *this;
    result.displacement_ = displacement;
    result.is_displaced_ = !displacement.isZero(0.0);
    return result;
  }
  /// The same for one with a further displacement. That of a late right image is a rotation of the rig.
  [[nodiscard]] PairGeometry displaced_further(const ImageDisplacement::Coefficients& by) const {
    if (!exposure_.is_late()) return displaced(displacement_ + by);
    PairGeometry result = *this;
    result.exposure_ = exposure_.turned(ImageDisplacement::rotation(by, camera_));
    return result;
  }
  [[nodiscard]] const ImageDisplacement::Coefficients& displacement() const noexcept { return displacement_; }

  /// The same for a frame whose right image was exposed while the rig had moved by `T_left_later`.
  [[nodiscard]] PairGeometry late(const Pose& T_left_later) const {
    PairGeometry result = *this;
    result.exposure_ = LateExposure(camera_, T_left_later);
    return result;
  }
  /// The stereo geometry of exact cameras.
  [[nodiscard]] const LateExposure& exposure() const noexcept { return exposure_; }

  [[nodiscard]] const LensResidual& lens() const noexcept { return lens_; }
  /// Position of the point in the left image, px.
  [[nodiscard]] Vector2<double> left_position(const StereoPoint& z) const {
    return lens_.in_image(z.head<2>());
  }
  /// Position of the point in the right image, px.
  [[nodiscard]] Vector2<double> right_position(const StereoPoint& z) const {
    return right_position(left_position(z), z.z());
  }
  /// Position in the right image of a point that the left image shows at `left_px`, px.
  [[nodiscard]] Vector2<double> right_position(const Vector2<double>& left_px, double disparity_px) const;

  /// A displacement and a roll of the right image: the offset of the rows of corners as a line along x.
  [[nodiscard]] RobustLine fit_rows(std::span<const CornerPair> corners) const;

  /// Root mean square over the image of an offset with these coefficients.
  [[nodiscard]] static double rms(const Basis& coefficients);
  /// The same of the offset in u and of that in v, px.
  [[nodiscard]] Vector2<double> rms_offset_px() const;

  /// Stereo measurement of a point that the images show at `left_px` and `right_px`.
  [[nodiscard]] StereoMeasurement measure(const Vector2<double>& left_px,
                                          const Vector2<double>& right_px) const;

 private:
  StereoCamera camera_;
  Coefficients coefficients_ = Coefficients::Zero();
  LensResidual lens_;
  LateExposure exposure_;
  ImageDisplacement::Coefficients displacement_ = ImageDisplacement::Coefficients::Zero();
  bool is_displaced_ = false;
};

/// How a frame was seen, and how it is seen since something was learned of its right image.
struct Remeasurement {
  PairGeometry before, after;

  /// What a point that was measured as `z` at `left_px` is measured as now.
  [[nodiscard]] StereoPoint of(const Vector2<double>& left_px, const StereoPoint& z) const {
    return after.measure(left_px, before.right_position(left_px, z.z())).z;
  }
  /// The same of a whole measurement.
  [[nodiscard]] StereoMeasurement of(const StereoMeasurement& match) const {
    const Vector2<double> expected_px = before.right_position(match.left_px, match.z.z());
    return after.measure(match.left_px, expected_px - Vector2<double>(0.0, match.row_error_px));
  }
};

}  // namespace stereo_slam
