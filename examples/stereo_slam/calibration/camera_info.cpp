// SPDX-License-Identifier: MIT
#include "stereo_slam/calibration/camera_info.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string_view>

#include <fmt/format.h>

#include "stereo_slam/calibration/given_distortion.hpp"

namespace stereo_slam {
namespace {

using CameraProjection = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;
constexpr double kSameProjection = 1e-6;  // relative tolerance

[[noreturn]] void refuse(const std::string& what) { throw std::invalid_argument(what); }

/// P, which has to be finite.
[[nodiscard]] CameraProjection projection_of(const CameraInfo& info, std::string_view side) {
  const CameraProjection P = Eigen::Map<const CameraProjection>(info.P.data());
  if (!P.allFinite()) refuse(fmt::format("the projection matrix of the {} camera is not finite", side));
  return P;
}

/// Throws std::invalid_argument if P is not [fx 0 cx Tx; 0 fy cy 0; 0 0 1 0]. `baseline` is |Tx| of the right
/// camera.
void require_projection(const CameraProjection& P, double baseline, std::string_view side) {
  constexpr double kMostAcross = 0.01;  // of the baseline
  Eigen::Matrix3d pinhole = Eigen::Matrix3d::Identity();
  pinhole(0, 0) = P(0, 0);
  pinhole(1, 1) = P(1, 1);
  pinhole.topRightCorner<2, 1>() = P.block<2, 1>(0, 2);
  if (!((P.leftCols<3>() - pinhole).cwiseAbs().maxCoeff() <= kSameProjection * P(0, 0) && P(1, 1) > 0.0)) {
    refuse(fmt::format(
        "the projection matrix of the {} camera is not [fx 0 cx Tx; 0 fy cy 0; 0 0 1 0]; calibrate the two "
        "cameras as a stereo pair",
        side));
  }
  const double across = std::max(std::abs(P(1, 3)), P(1, 1) * std::abs(P(2, 3)));
  if (across > kMostAcross * baseline) {
    refuse(fmt::format(
        "the projection matrix of the {} camera has the fourth column ({:.6g}, {:.6g}, {:.6g}), but its "
        "second and third numbers must be 0: rectified cameras lie side by side; calibrate the two cameras "
        "as a stereo pair",
        side, P(0, 3), P(1, 3), P(2, 3)));
  }
}

/// Throws std::invalid_argument if P[3] of the two cameras do not give the place of the right one. Either
/// camera may be the one that the other's P refers to.
void require_baseline(double left, double right) {
  const double longest = std::max(std::abs(left), std::abs(right));
  if (longest == 0.0) {
    refuse(
        "the projection matrix has no baseline, P[3] = -fx * baseline; calibrate the two cameras as a stereo "
        "pair");
  }
  const double least = kSameProjection * longest;
  if (std::abs(right) <= least && left < 0.0) {
    refuse(
        "the baseline is in the projection matrix of the left camera, not in that of the right one, and "
        "negative; "
        "the two are swapped: name them the other way round");
  }
  if (std::min(std::abs(left), std::abs(right)) > least)
    refuse("the projection matrices of both cameras have a baseline, P[3]; that of the left one must be 0");
}

/// Throws std::invalid_argument if the P of the two cameras are not of one stereo rectification. The
/// principal points may differ in x, as the right images may be shifted along their rows.
void require_stereo(const CameraProjection& left, const CameraProjection& right) {
  require_baseline(left(0, 3), right(0, 3));
  if (!(right(0, 0) > 0.0)) {
    refuse(fmt::format(
        "the projection matrix of the right camera has a focal length of {:.6g}; calibrate the two "
        "cameras as a stereo pair",
        right(0, 0)));
  }
  const double baseline = std::max(std::abs(left(0, 3)), std::abs(right(0, 3)));
  require_projection(left, baseline, "left");
  require_projection(right, baseline, "right");
  struct Element {
    std::string_view name;
    int row;
    int column;
  };
  for (const auto& [name, row, column] : {Element{"fx", 0, 0}, Element{"fy", 1, 1}, Element{"cy", 1, 2}}) {
    if (std::abs(left(row, column) - right(row, column)) <= kSameProjection * left(0, 0)) continue;
    refuse(fmt::format(
        "the projection matrices of the two cameras contradict each other: {} is {:.8g} in that of the left "
        "camera and {:.8g} in that of the right one; use the results of one stereo calibration",
        name, left(row, column), right(row, column)));
  }
}

[[nodiscard]] double baseline_of(const CameraProjection& left, const CameraProjection& right) {
  return std::abs(right(0, 3) - left(0, 3)) / right(0, 0);
}

[[nodiscard]] Lens lens_of(const CameraInfo& info, std::string_view side) {
  return pinhole_of(info,
                    [&](const std::string& what) { refuse(fmt::format("the {} camera: {}", side, what)); });
}

/// The rotation of a lens into the rectified camera. R of zeros was not set: it is the identity if P shows
/// the same image as the lens.
[[nodiscard]] Eigen::Quaterniond rectification_of(const CameraInfo& info, const Lens& lens,
                                                  std::string_view side) {
  constexpr double kTolerance = 1e-2;
  const Eigen::Matrix3d R = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(info.R.data());
  const CameraProjection P = projection_of(info, side);
  const Eigen::Vector4d difference(P(0, 0) - lens.fx, P(1, 1) - lens.fy, P(0, 2) - lens.cx,
                                   P(1, 2) - lens.cy);
  const bool same_image =
      lens.distortion == Distortion::kNone && difference.cwiseAbs().maxCoeff() <= kSameProjection * lens.fx;
  if ((R.array() == 0.0).all() && same_image) return Eigen::Quaterniond::Identity();
  if (!R.allFinite() || !R.isUnitary(kTolerance) || R.determinant() < 0.0) {
    refuse(fmt::format(
        "the rectification matrix R of the {} camera is not a rotation; calibrate the two cameras as "
        "a stereo pair",
        side));
  }
  return Eigen::Quaterniond(R).normalized();
}

}  // namespace

Lens pinhole_of(const CameraInfo& info, const Fail& fail) {
  if (!is_calibrated(info))
    fail(
        "the camera matrix is zero, which says that it is not calibrated; calibrate the two cameras as a "
        "stereo pair");
  const auto finite = [](double x) { return std::isfinite(x); };
  if (!std::all_of(info.K.begin(), info.K.end(), finite) ||
      !std::all_of(info.D.begin(), info.D.end(), finite))
    fail("the camera matrix and the distortion must be finite numbers");
  Lens lens;
  set_size(lens, {info.width_px, info.height_px}, fail);
  set_camera_matrix(lens, {info.K.begin(), info.K.end()}, fail);
  return lens;
}

StereoRig rig_of(const CameraInfo& left, const CameraInfo& right) {
  const CameraProjection P_left = projection_of(left, "left");
  const CameraProjection P_right = projection_of(right, "right");
  require_stereo(P_left, P_right);
  StereoRig rig;
  rig.left = lens_of(left, "left");
  rig.right = lens_of(right, "right");
  set_distortions(rig, {left.distortion_model, left.D}, {right.distortion_model, right.D}, refuse);
  // Both rectified cameras have the same axes; the right one lies on the left one's x axis.
  const Eigen::Translation3d T_right_left_rectified(-baseline_of(P_left, P_right), 0.0, 0.0);
  rig.T_right_left = Eigen::Isometry3d(rectification_of(right, rig.right, "right").conjugate()) *
                     T_right_left_rectified * rectification_of(left, rig.left, "left");
  return rig;
}

StereoCamera rectified_of(const CameraInfo& left, const CameraInfo& right) {
  const CameraProjection P_left = projection_of(left, "left");
  const CameraProjection P = projection_of(right, "right");
  require_stereo(P_left, P);
  if (std::abs(P_left(0, 2) - P(0, 2)) > kSameProjection * P(0, 0)) {
    refuse(fmt::format(
        "the projection matrices have the principal points cx = {:.6g} in the left and {:.6g} in the right "
        "camera: the cameras were calibrated without zero disparity, which is not read for rectified images; "
        "calibrate with CALIB_ZERO_DISPARITY, or name the topics of the raw images, which this program "
        "rectifies: --left-topic, --right-topic",
        P_left(0, 2), P(0, 2)));
  }
  if (left.width_px != right.width_px || left.height_px != right.height_px) {
    refuse(
        fmt::format("the image size is {}x{} for the left camera and {}x{} for the right one; rectified "
                    "images must have one "
                    "size",
                    left.width_px, left.height_px, right.width_px, right.height_px));
  }
  Lens size;
  set_size(size, {left.width_px, left.height_px}, refuse);
  return {.fx = P(0, 0),
          .fy = P(1, 1),
          .cx = P(0, 2),
          .cy = P(1, 2),
          .baseline_m = baseline_of(P_left, P),
          .width_px = size.width_px,
          .height_px = size.height_px};
}

std::string baseline_warning(const CameraInfo& left, const CameraInfo& right) {
  if (!(right.P[3] > left.P[3])) return "";
  return fmt::format(
      "P[3] of the right camera is {:.6g}, but must be negative, -fx * baseline; it is read as a baseline of "
      "{:.4g} m; "
      "if left and right look swapped, exchange the images of the two cameras together with their "
      "calibration",
      right.P[3], right.P[3] / right.P[0]);
}

}  // namespace stereo_slam
