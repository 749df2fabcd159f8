// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <ostream>
#include <vector>

#include "simulator/recording/imu.hpp"
#include "simulator/world/camera_path.hpp"
#include "stereo_slam/calibration/stereo_rig.hpp"

/// The text files of a recording in EuRoC's layout. Numbers are written in the fewest digits that read back
/// as exactly the same number.
namespace stereo_slam::simulator {

/// Stamp of a frame. All stamps are after 2001, so that they have as many digits as real ones.
[[nodiscard]] std::int64_t euroc_stamp_ns(std::size_t frame, double fps);

/// data.csv of a camera.
void write_euroc_rows(std::ostream& stream, std::size_t frames, double fps);

/// sensor.yaml of a camera.
void write_euroc_sensor(std::ostream& stream, const Lens& lens, const Eigen::Isometry3d& T_body_camera,
                        double fps);

/// data.csv of the ground truth, T_world_body of `body_path`, with the velocities and biases of `imu`; zeros
/// if that is empty.
void write_euroc_truth(std::ostream& stream, const CameraPath& body_path, const std::vector<ImuTruth>& imu,
                       double fps);

}  // namespace stereo_slam::simulator
