// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/dataset/sequence.hpp"
#include "stereo_slam/results/output.hpp"
#include "stereo_slam/settings/settings.hpp"

namespace stereo_slam {

/// What run.yaml contains besides the settings.
struct RunHeader {
  std::string state;  ///< running, finished, interrupted or failed
  std::string error;  ///< empty unless failed
  std::size_t frames_processed = 0;
  double seconds = 0.0;
  FrameCost frame_cost{};
  std::optional<RealtimeSummary> realtime = std::nullopt;
  std::string pose_frame = "camera";  ///< frame whose poses the trajectories contain: "camera" or "body"
  double peak_mb = std::numeric_limits<double>::quiet_NaN();  ///< memory of the process; NaN where unknown
  std::size_t bytes_per_keyframe = 0;                         ///< memory of loop closure; zero without it
  std::vector<UnreadableImage> unreadable{};
  ReasonCounts weak_frames_by_reason{};
  RigSummary rig{};                           ///< as learned at the end
  std::optional<InertialSummary> inertial{};  ///< nothing without an IMU
};

/// Writes run.yaml: version, state, dataset, host and all settings. load_settings reads it. If it cannot be
/// written, as on a full disk, the state in an earlier run.yaml is changed from running to failed, and
/// std::runtime_error is thrown.
void write_run_yaml(const std::filesystem::path& folder, const RunHeader& header,
                    const StereoSequence& sequence, const Settings& settings);

}  // namespace stereo_slam
