// SPDX-License-Identifier: MIT
#include "stereo_slam/calibration/rectifier.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include <fmt/format.h>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

namespace stereo_slam {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;

cv::Matx33d camera_matrix(const Lens& lens) {
  return {lens.fx, 0.0, lens.cx, 0.0, lens.fy, lens.cy, 0.0, 0.0, 1.0};
}

cv::Mat coefficients(const Lens& lens) {
  return lens.distortion == Distortion::kNone ? cv::Mat(cv::Mat::zeros(4, 1, CV_64F))
                                              : cv::Mat(lens.coefficients, /*copyData=*/true);
}

cv::Matx33d to_cv(const Eigen::Matrix3d& R) {
  cv::Matx33d result;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) result(i, j) = R(i, j);
  }
  return result;
}

/// Result of stereo rectification for both cameras.
struct Rectification {
  cv::Matx33d R_left, R_right;  ///< from the lens to the rectified camera
  cv::Matx34d P_left, P_right;
};

void check(const StereoRig& rig) {
  const auto& [left, right, T_right_left, T_body_left, imu_later_ns] = rig;
  if (std::min({left.width_px, left.height_px, right.width_px, right.height_px}) <= 0) {
    throw std::runtime_error(fmt::format("the image sizes are {}x{} and {}x{}, but must be positive",
                                         left.width_px, left.height_px, right.width_px, right.height_px));
  }
  if ((left.distortion == Distortion::kEquidistant) != (right.distortion == Distortion::kEquidistant)) {
    throw std::runtime_error(
        "one camera is a fisheye (equidistant) and the other is not; calibrate both with one distortion "
        "model");
  }
  // The right camera in the frame of the left one.
  const Eigen::Vector3d position_m = T_right_left.inverse().translation();
  if (!(position_m.norm() > 1e-6)) {
    throw std::runtime_error(
        "the two cameras are at the same place; the extrinsics must contain the baseline in metres");
  }
  constexpr double kMaxAngle_deg = 45.0;
  const double angle_deg = kDegrees * Eigen::AngleAxisd(T_right_left.linear()).angle();
  if (angle_deg > kMaxAngle_deg) {
    throw std::runtime_error(
        fmt::format("the two cameras are turned by {:.0f} degrees relative to each other; check the "
                    "extrinsics, which map camera to body coordinates in metres",
                    angle_deg));
  }
  if (std::abs(position_m.x()) < position_m.tail<2>().norm()) {
    throw std::runtime_error(
        fmt::format("the right camera lies at ({:.3g}, {:.3g}, {:.3g}) m of the left one, not beside it; "
                    "only horizontal stereo pairs are supported, so check the extrinsics",
                    position_m.x(), position_m.y(), position_m.z()));
  }
  if (position_m.x() < 0.0) {
    throw std::runtime_error(
        fmt::format("the right camera lies {:.3g} m to the left of the left one; exchange the two cameras, "
                    "or invert the transformation between them",
                    -position_m.x()));
  }
}

[[nodiscard]] cv::Size size_of(const Lens& lens) { return {lens.width_px, lens.height_px}; }

/// The lens with its image scaled to another size, which shows the same.
[[nodiscard]] Lens scaled_to(Lens lens, const cv::Size& size) {
  const double across = static_cast<double>(size.width) / lens.width_px;
  const double down = static_cast<double>(size.height) / lens.height_px;
  lens.fx *= across;
  lens.fy *= down;
  lens.cx *= across;
  lens.cy *= down;
  lens.width_px = size.width;
  lens.height_px = size.height;
  return lens;
}

/// Bouguet's rectification in OpenCV's implementation, which knows one image size: that of the left camera.
Rectification propose(const StereoRig& rig) {
  const Lens& left = rig.left;
  const cv::Size size = size_of(left);
  const Lens right = size_of(rig.right) == size ? rig.right : scaled_to(rig.right, size);
  const Eigen::Isometry3d& T_right_left = rig.T_right_left;
  const cv::Matx33d R = to_cv(T_right_left.linear());
  const Eigen::Vector3d t = T_right_left.translation();
  const cv::Vec3d translation(t.x(), t.y(), t.z());
  Rectification result;
  cv::Matx44d Q;
  if (left.distortion == Distortion::kEquidistant) {
    cv::fisheye::stereoRectify(camera_matrix(left), coefficients(left), camera_matrix(right),
                               coefficients(right), size, R, translation, result.R_left, result.R_right,
                               result.P_left, result.P_right, Q, cv::CALIB_ZERO_DISPARITY, size);
  } else {
    constexpr double kNoBorder = 0.0;
    cv::stereoRectify(camera_matrix(left), coefficients(left), camera_matrix(right), coefficients(right),
                      size, R, translation, result.R_left, result.R_right, result.P_left, result.P_right, Q,
                      cv::CALIB_ZERO_DISPARITY, kNoBorder, size);
  }
  return result;
}

/// A rotation from a lens into the rectified camera, its projection, and the size of the rectified image.
struct RectifiedView {
  cv::Matx33d R;
  cv::Matx34d P;
  cv::Size size;
};

/// Raw-image positions of every `step`-th rectified pixel, the border included.
std::pair<cv::Mat1f, cv::Mat1f> lens_positions(const Lens& lens, const RectifiedView& view, int step = 1) {
  const auto& R = view.R;
  cv::Matx34d P = view.P;
  const cv::Size size((view.size.width - 2) / step + 2, (view.size.height - 2) / step + 2);
  for (int j = 0; j < 4; ++j) {
    P(0, j) /= step;
    P(1, j) /= step;
  }
  cv::Mat1f columns;
  cv::Mat1f rows;
  if (lens.distortion == Distortion::kEquidistant) {
    cv::fisheye::initUndistortRectifyMap(camera_matrix(lens), coefficients(lens), R, P, size, CV_32FC1,
                                         columns, rows);
  } else {
    cv::initUndistortRectifyMap(camera_matrix(lens), coefficients(lens), R, P, size, CV_32FC1, columns, rows);
  }
  return {columns, rows};
}

/// Share of the rectified pixels, every `step`-th one, that are inside both raw images.
double share_seen(const StereoRig& rig, const Rectification& r, int step = 1) {
  const auto seen = [](const Lens& lens, const std::pair<cv::Mat1f, cv::Mat1f>& positions) {
    cv::Mat1b columns;
    cv::Mat1b rows;
    cv::inRange(positions.first, 0.0, lens.width_px - 1.0, columns);
    cv::inRange(positions.second, 0.0, lens.height_px - 1.0, rows);
    return cv::Mat1b(columns & rows);
  };
  const cv::Size size = size_of(rig.left);
  const cv::Mat1b both = seen(rig.left, lens_positions(rig.left, {r.R_left, r.P_left, size}, step)) &
                         seen(rig.right, lens_positions(rig.right, {r.R_right, r.P_right, size}, step));
  return cv::countNonZero(both) / static_cast<double>(both.total());
}

/// Every how many pixels of an image the coverage is looked at: at no more than two million.
int coverage_step(const cv::Size& size) {
  constexpr double kMostSamples = 2e6;
  return std::max(1, static_cast<int>(std::ceil(std::sqrt(size.area() / kMostSamples))));
}

/// The rectification with another focal length, and the principal point in the image centre.
Rectification with_focal_length(Rectification r, const Lens& lens, double focal_px) {
  const double shift = r.P_right(0, 3) / r.P_right(0, 0);
  for (auto* P : {&r.P_left, &r.P_right}) {
    (*P)(0, 0) = (*P)(1, 1) = focal_px;
    (*P)(0, 2) = 0.5 * (lens.width_px - 1);
    (*P)(1, 2) = 0.5 * (lens.height_px - 1);
  }
  r.P_right(0, 3) = focal_px * shift;
  return r;
}

/// The rectification of fisheye lenses. cv::fisheye checks only four points of the border, so the focal
/// length is increased here until no border is black. It starts at a field of view of 110 degrees: wider
/// pinhole images stretch the border and lose resolution in the middle.
Rectification without_border(const StereoRig& rig, const Rectification& proposed) {
  constexpr double kMaxHalfView_rad = 55.0 / kDegrees;
  constexpr double kGrowth = 1.01;
  constexpr int kMaxSteps = 100;
  constexpr int kStep_px = 8;
  double focal_px = std::max(0.5 * rig.left.width_px / std::tan(kMaxHalfView_rad), proposed.P_left(0, 0));
  for (int step = 0; step < kMaxSteps; ++step, focal_px *= kGrowth) {
    const Rectification r = with_focal_length(proposed, rig.left, focal_px);
    if (share_seen(rig, r, kStep_px) == 1.0) return r;
  }
  return proposed;
}

Rectification rectify(const StereoRig& rig) {
  try {
    const Rectification proposed = propose(rig);
    return rig.left.distortion == Distortion::kEquidistant ? without_border(rig, proposed) : proposed;
  } catch (const cv::Exception&) {
    throw std::runtime_error(
        "rectification is impossible; intrinsics, distortion and extrinsics do not fit together");
  }
}

/// Whether focal lengths and baseline are positive and all values finite. For distortions that no real lens
/// has, OpenCV returns negative or NaN focal lengths.
[[nodiscard]] bool is_a_camera(const StereoCamera& camera) {
  const auto positive = [](double x) { return std::isfinite(x) && x > 0.0; };
  return positive(camera.fx) && positive(camera.fy) && positive(camera.baseline_m) &&
         std::isfinite(camera.cx) && std::isfinite(camera.cy);
}

}  // namespace

Rectifier::Rectifier(const StereoRig& rig) : left_size_(size_of(rig.left)), right_size_(size_of(rig.right)) {
  check(rig);
  const Rectification r = rectify(rig);
  const double focal_px = r.P_left(0, 0);
  camera_ = {.fx = focal_px,
             .fy = r.P_left(1, 1),
             .cx = r.P_left(0, 2),
             .cy = r.P_left(1, 2),
             .baseline_m = -r.P_right(0, 3) / focal_px,
             .width_px = rig.left.width_px,
             .height_px = rig.left.height_px};
  Eigen::Matrix3d R_camera_left;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) R_camera_left(i, j) = r.R_left(i, j);
  }
  T_left_camera_.linear() = R_camera_left.transpose();

  coverage_ = share_seen(rig, r, coverage_step(left_size_));
  constexpr double kMinCoverage = 0.5;
  if (!is_a_camera(camera_) || !(coverage_ > kMinCoverage)) {
    throw std::runtime_error(
        fmt::format("rectification leaves {:.0f} % of the image and a focal length of {:.4g} px; intrinsics, "
                    "distortion and extrinsics do not fit together",
                    100.0 * coverage_, focal_px));
  }
  left_->lens = rig.left;
  left_->R = r.R_left;
  left_->P = r.P_left;
  right_->lens = rig.right;
  right_->R = r.R_right;
  right_->P = r.P_right;
}

cv::Mat Rectifier::apply(View& view, const cv::Mat& image) const {
  std::call_once(view.made, [&] {
    const auto [columns, rows] = lens_positions(view.lens, {view.R, view.P, left_size_});
    cv::convertMaps(columns, rows, view.whole, view.fraction, CV_16SC2);
  });
  cv::Mat rectified;
  // Linear interpolation would blur each pixel differently and so bias the disparities.
  cv::remap(image, rectified, view.whole, view.fraction, cv::INTER_CUBIC, cv::BORDER_REPLICATE);
  return rectified;
}

}  // namespace stereo_slam
