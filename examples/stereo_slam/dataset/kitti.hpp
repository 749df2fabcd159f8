// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string_view>

#include "stereo_slam/dataset/sequence.hpp"

namespace stereo_slam {

inline constexpr std::string_view kKittiLayout =
    "calib.txt, times.txt, image_0/000000.png ..., image_1/000000.png ...";

/// Whether the folder contains any part of a KITTI odometry sequence, or a drive of the raw data.
[[nodiscard]] bool looks_like_kitti(const std::filesystem::path& folder);

/// Scans a sequence of the KITTI odometry benchmark: calib.txt (P0 and P1, the rectified 3x4 projections of
/// the left and right grey camera; P1(0,3) = -fx b), times.txt (seconds, one per frame), image_0 and image_1
/// (left, right), and poses.txt (3x4 T_world_camera, one per frame) if there is one. Where these folders are
/// not complete, image_2 and image_3 are used, the colour cameras, with P2 and P3. A drive of the raw data is
/// read by scan_kitti_raw().
[[nodiscard]] SequenceScan scan_kitti(const std::filesystem::path& folder,
                                      const PairingOptions& pairing = {});

}  // namespace stereo_slam
