// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <mutex>

#include <Eigen/Geometry>
#include <opencv2/core.hpp>

#include "stereo_slam/calibration/stereo_rig.hpp"
#include "stereo_slam/core/stereo_camera.hpp"

namespace stereo_slam {

/// Rectifies the images of two lenses to those of one StereoCamera: both are rotated so that rows correspond,
/// and distortion is removed. The focal length is the smallest without a black border; a fisheye is cut to a
/// field of view of 110 degrees. Both get the size of the left images. The maps are computed with the first
/// image, so that a rectifier which is only asked for its camera takes no memory. The object is safe to use
/// from several threads.
class Rectifier {
 public:
  /// Throws std::runtime_error for cameras that cannot be rectified: of different lens models,
  /// swapped, one above the other, or looking in different directions.
  explicit Rectifier(const StereoRig& rig);

  /// The camera of the rectified images.
  [[nodiscard]] const StereoCamera& camera() const noexcept { return camera_; }

  /// Pose of the rectified left camera in the frame of the left lens: a rotation without translation.
  [[nodiscard]] const Eigen::Isometry3d& T_left_camera() const noexcept { return T_left_camera_; }

  /// Share of the rectified pixels that are inside both raw images.
  [[nodiscard]] double coverage() const noexcept { return coverage_; }

  /// The sizes of the raw images.
  [[nodiscard]] const cv::Size& left_size() const noexcept { return left_size_; }
  [[nodiscard]] const cv::Size& right_size() const noexcept { return right_size_; }

  [[nodiscard]] cv::Mat left(const cv::Mat& image) const { return apply(*left_, image); }
  [[nodiscard]] cv::Mat right(const cv::Mat& image) const { return apply(*right_, image); }

 private:
  /// Of one camera: the rotation from the lens to the rectified camera and its projection, and, once there is
  /// an image, the position of each rectified pixel in it as cv::convertMaps gives it: whole pixels, and an
  /// index of the fraction.
  struct View {
    Lens lens;
    cv::Matx33d R;
    cv::Matx34d P;
    std::once_flag made;
    cv::Mat whole;
    cv::Mat fraction;
  };
  cv::Mat apply(View& view, const cv::Mat& image) const;

  cv::Size left_size_;
  cv::Size right_size_;
  StereoCamera camera_;
  Eigen::Isometry3d T_left_camera_ = Eigen::Isometry3d::Identity();
  double coverage_ = 1.0;
  std::unique_ptr<View> left_ = std::make_unique<View>();
  std::unique_ptr<View> right_ = std::make_unique<View>();
};

}  // namespace stereo_slam
