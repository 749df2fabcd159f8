// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>

#include "stereo_slam/dataset/sequence.hpp"

namespace stereo_slam {

/// Whether the folder is a drive of KITTI's raw data, or contains the calibration of drives.
[[nodiscard]] bool looks_like_kitti_raw(const std::filesystem::path& folder);

/// Scans a drive of KITTI's raw data, or the only drive in a folder of one day:
///  - image_00 and image_01 (left, right), or image_02 and image_03 if these are not complete, each with
///    timestamps.txt and data/0000000000.png ...;
///  - calib_cam_to_cam.txt, in the drive or beside it. The size of the images tells whether they are
///  rectified
///    (sync): then images of one number are a pair. Raw ones (extract) are rectified, and paired by stamp;
///  - the ground truth: oxts, with calib_imu_to_velo.txt and calib_velo_to_cam.txt. The body is the IMU.
[[nodiscard]] SequenceScan scan_kitti_raw(const std::filesystem::path& folder,
                                          const PairingOptions& pairing = {});

}  // namespace stereo_slam
