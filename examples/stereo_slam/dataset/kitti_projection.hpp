// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>

#include <Eigen/Core>

#include "stereo_slam/core/stereo_camera.hpp"

namespace stereo_slam {

/// A rectified camera of KITTI, 3x4: pixels of a point in the frame of the rectified camera 0.
struct KittiProjection {
  std::string name;  ///< "P0", "P_rect_02"
  Eigen::Matrix<double, 3, 4, Eigen::RowMajor> P;

  /// Where camera 0 is in the frame of this camera, m.
  [[nodiscard]] Eigen::Vector3d position_of_camera_0_m() const;
};

/// The camera of rectified images, without their size. Throws std::runtime_error that names the file if the
/// two are not cameras side by side with common intrinsics.
[[nodiscard]] StereoCamera camera_of(const KittiProjection& left, const KittiProjection& right,
                                     const std::filesystem::path& file);

}  // namespace stereo_slam
