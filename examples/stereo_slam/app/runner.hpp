// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "stereo_slam/dataset/sequence.hpp"
#include "stereo_slam/results/output.hpp"
#include "stereo_slam/results/pose_frame.hpp"
#include "stereo_slam/settings/settings.hpp"

namespace stereo_slam {

struct RunOptions {
  std::filesystem::path output;
  std::optional<std::size_t> max_frames;
  std::optional<int> threads;  ///< nothing: OpenCV's choice; 1: loop closing has no thread, either
  bool quiet = false;
  bool view = false;
  bool realtime = false;   ///< offer frames at the pace of their stamps; drop those not taken in time
  bool overwrite = false;  ///< replace the results of an earlier run
  std::optional<std::filesystem::path> load_map = std::nullopt;  ///< to localise in; with save_map, to extend
  std::optional<std::filesystem::path> save_map = std::nullopt;
  std::optional<std::filesystem::path> debug_images = std::nullopt;  ///< folder
  PoseFrame pose_frame = PoseFrame::kCamera;
};

/// How a run ended.
struct RunSummary {
  std::size_t frames = 0;
  std::size_t lost = 0;  ///< frames without odometry and landmarks, and those before the map began
  std::map<std::string, std::size_t> frames_by_status;
  std::size_t keyframes = 0;
  std::size_t landmarks = 0;
  std::size_t loops_accepted = 0;
  std::size_t loops_refused = 0;
  double path_m = 0.0;        ///< length of the final trajectory
  double last_sigma_m = 0.0;  ///< standard deviation of the last pose: root mean square of the axes
  double last_sigma_deg = 0.0;
  double peak_mb = 0.0;  ///< memory of the process; NaN where unknown
  double seconds = 0.0;
  FrameCost frame_cost{};
  std::optional<RealtimeSummary> realtime = std::nullopt;
  bool interrupted = false;
  std::string error;  ///< what stopped the run; empty if nothing did
};

/// Runs the SLAM on a recording and writes the results. Another thread reads images ahead. Each frame is
/// appended to the result files before the next one begins. SIGINT, SIGTERM and SIGHUP end the run after the
/// current frame; the frames before a signal or an error are saved. The results do not depend on the number
/// of threads; with `realtime` they depend on the speed of the machine. Throws std::runtime_error when the
/// run cannot start: the output or the map file cannot be used, `pose_frame` is the body and the calibration
/// has no body frame, or `realtime` is set and the stamps do not increase or have a gap of more than ten
/// minutes.
[[nodiscard]] RunSummary run(const StereoSequence& sequence, const Settings& settings,
                             const RunOptions& options);

}  // namespace stereo_slam
