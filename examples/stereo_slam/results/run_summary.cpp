// SPDX-License-Identifier: MIT
#include "stereo_slam/results/run_summary.hpp"

#include <cmath>
#include <numbers>
#include <stdexcept>

#include <fmt/format.h>

#include "stereo_slam/io/counted.hpp"

namespace stereo_slam {

RunSummary summary_of(const RunRecord& record) {
  RunSummary summary;
  summary.frames = record.results.size();
  summary.lost =
      count_frames(record, [](const FrameResult& result) { return result.status == TrackingStatus::kLost; });
  summary.unmeasured = count_frames(record, [](const FrameResult& result) {
    return result.status == TrackingStatus::kLost || result.weak.repeated_image;
  });
  for (const auto& result : record.results) {
    ++summary.frames_by_status[to_string(result.status)];
    if (!result.right_image_fits) summary.right_image_misfits.push_back(result.index);
    if (result.weak.right_camera_turned) summary.right_camera_turns.push_back(result.index);
  }
  summary.weak_frames_by_reason = count_reasons(record, TrackingStatus::kWeak);
  summary.rig = record.rig;
  summary.inertial = record.inertial;
  for (const auto& result : record.results) {
    if (result.inertial.phase == InertialPhase::kRunning) summary.last_inertial = result.inertial;
  }
  summary.unreadable = record.unreadable;
  summary.keyframes = count_frames(record, &FrameResult::is_keyframe);
  summary.landmarks = record.map_points.size();
  for (const auto& loop : record.loops) ++(loop.accepted ? summary.loops_accepted : summary.loops_refused);
  for (std::size_t i = 1; i < record.trajectory.size(); ++i) {
    summary.path_m +=
        (record.trajectory[i].pose.translation() - record.trajectory[i - 1].pose.translation()).norm();
  }
  if (!record.trajectory.empty()) {
    const auto& covariance = record.trajectory.back().covariance;
    constexpr double kDegrees = 180.0 / std::numbers::pi;
    summary.last_sigma_deg = kDegrees * std::sqrt(covariance.topLeftCorner<3, 3>().trace() / 3.0);
    summary.last_sigma_m = std::sqrt(covariance.bottomRightCorner<3, 3>().trace() / 3.0);
  }
  summary.frame_cost = frame_cost(record);
  summary.realtime = realtime_summary(record);
  return summary;
}

void require_tracked(const RunSummary& summary) {
  if (summary.frames <= 1 || summary.unmeasured + 1 < summary.frames) return;
  if (summary.unreadable.size() >= summary.frames / 2) {
    throw std::runtime_error(
        fmt::format("tracked {} of {} frames, because {} could not be read; the first: {}",
                    summary.frames - summary.unmeasured, summary.frames,
                    counted(summary.unreadable.size(), "image"), summary.unreadable.front().fault));
  }
  throw std::runtime_error(fmt::format(
      "tracked {} of {} frames: hardly any corner was matched between left and right and to the next frame; "
      "check for black, blurred or repeated images, swapped cameras, the calibration of another camera, a "
      "low frame rate, and settings that allow too few points; --clahe helps with dark images",
      summary.frames - summary.unmeasured, summary.frames));
}

}  // namespace stereo_slam
