// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "stereo_slam/results/output.hpp"

namespace stereo_slam {

/// How a run ended.
struct RunSummary {
  std::size_t frames = 0;
  std::size_t lost = 0;        ///< frames without odometry and landmarks, and those before the map began
  std::size_t unmeasured = 0;  ///< frames that are lost, or have the image of the frame before
  std::map<std::string, std::size_t> frames_by_status;
  ReasonCounts weak_frames_by_reason{};          ///< why frames have the status kWeak
  std::vector<std::size_t> right_image_misfits;  ///< frames whose right image does not fit the left one
  std::vector<std::size_t> right_camera_turns;   ///< frames in which a turn of the right camera was noticed
  RigSummary rig{};                              ///< as learned at the end
  std::optional<InertialSummary> inertial{};     ///< nothing without an IMU
  std::optional<InertialEstimate> last_inertial{};  ///< of the last frame in which its filter ran
  std::vector<UnreadableImage> unreadable;          ///< images that were treated as missing
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
  std::string error;               ///< what stopped the run; empty if nothing did
  bool folder_in_place = true;     ///< false if the output folder was moved or removed during the run
  std::size_t saved = 0;           ///< frames in the results
  bool all_frames = false;         ///< false if an error ended the run before its last frame
  std::filesystem::path folder{};  ///< of the results: that of --output, or `unfinished` in it
  std::optional<std::filesystem::path> map = std::nullopt;   ///< where the map is, if beside an earlier one
  std::optional<std::filesystem::path> mcap = std::nullopt;  ///< where --mcap is, if beside an earlier one
};

/// What the record says. `peak_mb`, `seconds`, and what stopped the run are left to the caller.
[[nodiscard]] RunSummary summary_of(const RunRecord& record);

/// Throws std::runtime_error, which says what to check, if no frame of several was tracked.
void require_tracked(const RunSummary& summary);

}  // namespace stereo_slam
