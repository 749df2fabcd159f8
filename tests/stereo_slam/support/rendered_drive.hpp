// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Geometry>

#include "simulator/recording/simulate.hpp"
#include "stereo_slam/dataset/sequence.hpp"
#include "stereo_slam/io/trajectory_io.hpp"
#include "stereo_slam/support/support.hpp"

namespace stereo_slam::test {

/// A recording rendered for a test, gone with it.
struct RenderedDrive {
  TemporaryFolder folder;
  StereoSequence sequence;
  std::vector<Eigen::Isometry3d> truth;  ///< T_world_camera of every frame

  explicit RenderedDrive(const simulator::SimulationSettings& settings) {
    simulator::simulate(settings, folder.path());
    sequence = open_sequence(folder.path(), "kitti");
    truth = read_trajectory(folder / "poses.txt").poses;
  }
};

}  // namespace stereo_slam::test
