// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Geometry>
#include <opencv2/core.hpp>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/dataset/stereo_rig.hpp"

namespace stereo_slam {

/// Turns the images of two lenses into those of one StereoCamera: both views are rotated until rows agree,
/// distortion is removed, and the focal length is the smallest that leaves no black border, or that of a view
/// of 110 degrees where a fisheye sees more. The size of the images stays. The maps are computed once; the
/// object may be used from several threads.
class Rectifier {
 public:
  /// Throws std::runtime_error for cameras that cannot be rectified: of two sizes or of two families of
  /// models, swapped, one above the other, or looking in different directions.
  explicit Rectifier(const StereoRig& rig);

  /// What the rectified images are seen with.
  [[nodiscard]] const StereoCamera& camera() const noexcept { return camera_; }

  /// The rectifying rotation: the rectified left camera in the frame of the left lens. No translation.
  [[nodiscard]] const Eigen::Isometry3d& T_left_camera() const noexcept { return T_left_camera_; }

  /// Share of the rectified pixels that both lenses see.
  [[nodiscard]] double coverage() const noexcept { return coverage_; }

  [[nodiscard]] cv::Mat left(const cv::Mat& image) const { return apply(left_, image); }
  [[nodiscard]] cv::Mat right(const cv::Mat& image) const { return apply(right_, image); }

 private:
  /// Of each rectified pixel, where the lens shows it: whole pixels and an index of the fraction.
  struct Maps {
    cv::Mat whole;
    cv::Mat fraction;
  };
  static cv::Mat apply(const Maps& maps, const cv::Mat& image);

  StereoCamera camera_;
  Eigen::Isometry3d T_left_camera_ = Eigen::Isometry3d::Identity();
  double coverage_ = 1.0;
  Maps left_;
  Maps right_;
};

}  // namespace stereo_slam
