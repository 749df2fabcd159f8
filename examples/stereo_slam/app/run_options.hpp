// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>

#include "stereo_slam/results/pose_frame.hpp"

namespace stereo_slam {

/// What the command line says about a run, besides the settings.
struct RunOptions {
  std::filesystem::path output;
  std::optional<std::size_t> max_frames;
  std::optional<int> threads;  ///< nothing: OpenCV's choice; 1: loop closing has no thread, either
  bool quiet = false;
  bool view = false;
  bool realtime = false;   ///< offer frames at the pace of their stamps; drop those not taken in time
  bool strict = false;     ///< an image that cannot be read ends the run
  bool overwrite = false;  ///< replace the results of an earlier run
  std::optional<std::filesystem::path> load_map = std::nullopt;  ///< to localise in; with save_map, to extend
  std::optional<std::filesystem::path> save_map = std::nullopt;
  std::optional<std::filesystem::path> learned = std::nullopt;  ///< cameras.yaml of an earlier run
  std::optional<DelayEstimate> right_delay = std::nullopt;      ///< of the right images, as a check found
  std::optional<std::filesystem::path> mcap = std::nullopt;     ///< file for the results as messages of ROS 2
  bool mcap_images = false;                                     ///< with small left images in it
  std::optional<std::filesystem::path> debug_images = std::nullopt;  ///< folder
  PoseFrame pose_frame = PoseFrame::kCamera;
};

}  // namespace stereo_slam
