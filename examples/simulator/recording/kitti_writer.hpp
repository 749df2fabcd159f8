// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <ostream>

#include "simulator/rendering/projection.hpp"
#include "simulator/world/camera_path.hpp"

/// The text files of a recording in KITTI's layout. Numbers are written in the fewest digits that read back
/// as exactly the same number.
namespace stereo_slam::simulator {

/// calib.txt: P0 .. P3; P2 and P3, the colour cameras, repeat the grey ones.
void write_kitti_calibration(std::ostream& stream, const PinholeCamera& camera, double baseline_m);

/// times.txt, seconds.
void write_kitti_times(std::ostream& stream, std::size_t frames, double fps);

/// poses.txt: the upper three rows of T_world_camera.
void write_kitti_poses(std::ostream& stream, const CameraPath& path);

}  // namespace stereo_slam::simulator
