// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>

#include "stereo_slam/dataset/rig_file.hpp"

namespace stereo_slam {

/// The calibration of a stereo camera, from a file of any of these kinds, told apart by their contents:
///  - calibration.yaml of docs/datasets.md;
///  - Kalibr's camchain.yaml;
///  - the results of cv::stereoCalibrate as OpenCV's FileStorage writes them, in YAML or XML: M1, D1, M2, D2
///    (or K1 ...), R and T; R and T may be in extrinsics.yml beside the file;
///  - ROS camera_info as left.yaml, with right.yaml beside it, or the folder of both.
/// If the file does not give the image size, the lenses have width 0. Throws std::runtime_error that names
/// file and remedy.
[[nodiscard]] OwnCamera read_calibration(const std::filesystem::path& file);

/// One camera as sensor_msgs/CameraInfo describes it.
struct CameraInfo {
  Lens lens;                                        ///< from K and D
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();  ///< rotates vectors of the lens into the rectified camera
  Eigen::Matrix<double, 3, 4> P = Eigen::Matrix<double, 3, 4>::Zero();  ///< of the rectified camera
};

/// The rig of two raw cameras, whose relative pose follows from R and P. Throws std::invalid_argument if P of
/// the right camera has no baseline, or if the two P contradict each other.
[[nodiscard]] StereoRig rig_of(const CameraInfo& left, const CameraInfo& right);

/// The camera of images that were rectified by R and P, with the image size. Throws std::invalid_argument
/// where rig_of() does, if the image sizes differ, or if the right images are shifted along their rows.
[[nodiscard]] StereoCamera rectified_of(const CameraInfo& left, const CameraInfo& right);

}  // namespace stereo_slam
