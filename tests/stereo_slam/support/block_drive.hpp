// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Geometry>

#include "stereo_slam/dataset/sequence.hpp"
#include "stereo_slam/support/rendered_drive.hpp"

namespace stereo_slam::test {

/// A drive around a block of houses at 0.4 of KITTI's size, held in memory: nearly two laps.
struct BlockDrive {
  static constexpr std::size_t kFramesOfOneLap = 200;  ///< and again through the street where it began
  static constexpr std::size_t kFrames = 260;

  StereoCamera camera;
  std::vector<StereoFrame> frames;
  std::vector<Eigen::Isometry3d> truth;  ///< T_world_camera

  BlockDrive() {
    simulator::SimulationSettings settings;
    settings.frames = static_cast<int>(kFrames);
    settings.fps = 7.0;
    settings.loop.block_length_m = 44.0;
    settings.loop.block_width_m = 36.0;
    settings.camera = {496, 150, 288.0, 288.0, 248.0, 74.0};
    const RenderedDrive rendered(settings);
    camera = rendered.sequence.camera;
    for (std::size_t i = 0; i < kFrames; ++i) frames.push_back(load_frame(rendered.sequence, i));
    truth = rendered.truth;
  }
};

/// Rendered once a program, which takes longer than to follow it.
inline const BlockDrive& block_drive() {
  static const BlockDrive rendered;
  return rendered;
}

}  // namespace stereo_slam::test
