// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstddef>

#include "stereo_slam/io/trajectory_io.hpp"
#include "stereo_slam/results/output.hpp"

namespace stereo_slam::test {

inline Pose at(const Vector3<double>& position) {
  return Pose::from_matrix(Matrix3<double>::Identity(), position);
}

/// A drive along z, a metre and a tenth of a second a frame, whose position gets less certain.
inline RunRecord drive(std::size_t frames) {
  RunRecord record;
  for (std::size_t k = 0; k < frames; ++k) {
    const auto z = static_cast<double>(k);
    FrameResult result;
    result.index = k;
    result.stamp_ns = 1'000'000'000'000 + 100'000'000 * static_cast<std::int64_t>(k);
    result.status = k == 0 ? TrackingStatus::kInitializing : TrackingStatus::kOk;
    result.T_odometry_camera = at({0.01 * z, 0.0, z});
    result.features = 1000;
    result.landmarks = 300;
    result.matches = 200;
    result.nis = k == 0 ? 0.0 : 90.0 + 20.0 * std::sin(z);
    result.nis_dof = k == 0 ? 0 : 100;
    result.is_keyframe = k % 10 == 0;
    result.keyframe = k == 0 ? 0 : (k - 1) / 10 * 10;
    result.relative_covariance = 1e-4 * Matrix6<double>::Identity();
    result.times = {{"features", 10.0 + std::sin(z)}, {"odometry", 5.0}};
    record.results.push_back(result);
    record.total_ms.push_back(17.0);
    record.cpu_ms.push_back(25.0);
    record.read_cpu_ms.push_back(3.0);
    record.resident_mb.push_back(200.0 + z);
    record.trajectory.push_back({at({0.0, 0.0, z}), 1e-6 * z * Matrix6<double>::Identity()});
    record.map_points.push_back({{5.0 * std::sin(7.0 * z), -1.0, z}, 100});
  }
  return record;
}

/// The same drive as a ground truth in another world, turned about the vertical and shifted.
inline Trajectory true_drive(std::size_t frames) {
  Trajectory truth;
  Eigen::Isometry3d T_truth_world = Eigen::Isometry3d::Identity();
  T_truth_world.linear() = Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitY()).toRotationMatrix();
  T_truth_world.translation() << 5.0, 6.0, 7.0;
  for (std::size_t k = 0; k < frames; ++k) {
    truth.stamps_ns.push_back(1'000'000'000'000 + 100'000'000 * static_cast<std::int64_t>(k));
    truth.poses.push_back(T_truth_world * at({0.0, 0.0, static_cast<double>(k)}).isometry());
  }
  return truth;
}

}  // namespace stereo_slam::test
