// SPDX-License-Identifier: MIT
#include "simulator/recording/kitti_writer.hpp"

#include <fmt/format.h>
#include <fmt/ostream.h>

namespace stereo_slam::simulator {

void write_kitti_calibration(std::ostream& stream, const PinholeCamera& camera, double baseline_m) {
  for (int i = 0; i < 4; ++i) {
    const double shift = i % 2 == 0 ? 0.0 : -camera.fx * baseline_m;
    fmt::print(stream, "P{}: {} 0 {} {} 0 {} {} 0 0 0 1 0\n", i, camera.fx, camera.cx, shift, camera.fy,
               camera.cy);
  }
}

void write_kitti_times(std::ostream& stream, std::size_t frames, double fps) {
  for (std::size_t i = 0; i < frames; ++i) fmt::print(stream, "{}\n", static_cast<double>(i) / fps);
}

void write_kitti_poses(std::ostream& stream, const CameraPath& path) {
  for (const Eigen::Isometry3d& pose : path) {
    const Eigen::Matrix<double, 3, 4, Eigen::RowMajor> rows = pose.matrix().topRows<3>();
    fmt::print(stream, "{}\n", fmt::join(rows.data(), rows.data() + rows.size(), " "));
  }
}

}  // namespace stereo_slam::simulator
