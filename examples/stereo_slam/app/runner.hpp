// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>

#include "stereo_slam/dataset/sequence.hpp"
#include "stereo_slam/results/pose_frame.hpp"
#include "stereo_slam/settings/settings.hpp"

namespace stereo_slam {

struct RunOptions {
  std::filesystem::path output;
  std::optional<std::size_t> max_frames;
  std::optional<int> threads;  ///< of OpenCV's pool; its own choice without
  bool quiet = false;
  bool view = false;
  std::optional<std::filesystem::path> load_map =
      std::nullopt;  ///< to localise in, or with save_map to continue
  std::optional<std::filesystem::path> save_map = std::nullopt;
  std::optional<std::filesystem::path> debug_images = std::nullopt;  ///< folder for them
  PoseFrame pose_frame = PoseFrame::kCamera;
};

/// How a run ended.
struct RunSummary {
  std::size_t frames = 0;
  std::size_t lost = 0;  ///< frames without any odometry or landmarks, those before the map began, too
  std::size_t landmarks = 0;
  double seconds = 0.0;
  double median_ms = 0.0;  ///< of processing a frame, images already read
  bool interrupted = false;
  std::string error;  ///< what stopped the run, empty when nothing did
};

/// Feeds a recording to the SLAM and writes the results: images are read ahead on a thread of their own,
/// SIGINT, SIGTERM and SIGHUP end the run after the current frame. Whatever ends it, the frames finished
/// until then are saved. The results do not depend on the number of threads. Throws std::runtime_error when
/// there is no place to write to, or no body whose poses are wanted.
[[nodiscard]] RunSummary run(const StereoSequence& sequence, const Settings& settings,
                             const RunOptions& options);

}  // namespace stereo_slam
