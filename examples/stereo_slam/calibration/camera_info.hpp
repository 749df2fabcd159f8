// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <string>
#include <vector>

#include "stereo_slam/calibration/lens_values.hpp"
#include "stereo_slam/calibration/stereo_rig.hpp"
#include "stereo_slam/core/stereo_camera.hpp"

namespace stereo_slam {

/// One camera as sensor_msgs/CameraInfo describes it. Matrices are row by row.
struct CameraInfo {
  double width_px = 0.0;
  double height_px = 0.0;
  std::string distortion_model;  ///< may be empty
  std::vector<double> D;         ///< distortion; may be empty
  std::array<double, 9> K{};     ///< of the raw camera; zeros if it is not calibrated
  std::array<double, 9> R{};     ///< rotates vectors of the lens into the rectified camera; may be zeros
  std::array<double, 12> P{};    ///< of the rectified camera

  friend bool operator==(const CameraInfo&, const CameraInfo&) = default;
};

/// Whether the message says so: K[0] is 0 in those of a camera that is not calibrated.
[[nodiscard]] inline bool is_calibrated(const CameraInfo& info) { return info.K[0] != 0.0; }

/// Size and pinhole of the raw camera.
[[nodiscard]] Lens pinhole_of(const CameraInfo& info, const Fail& fail);

/// The rig of two raw cameras, whose relative pose follows from R and P. Throws std::invalid_argument if P of
/// the two cameras have no baseline, or if the two P contradict each other.
[[nodiscard]] StereoRig rig_of(const CameraInfo& left, const CameraInfo& right);

/// The camera of images that were rectified by R and P, with the image size. K, D and R are not used. Throws
/// std::invalid_argument where rig_of() does, if the image sizes differ, or if the right images are shifted
/// along their rows.
[[nodiscard]] StereoCamera rectified_of(const CameraInfo& left, const CameraInfo& right);

/// A warning that P[3] of the right camera is positive, though the camera is not to the left of the other:
/// such a baseline is read as if it were negative. Empty if it is negative.
[[nodiscard]] std::string baseline_warning(const CameraInfo& left, const CameraInfo& right);

}  // namespace stereo_slam
