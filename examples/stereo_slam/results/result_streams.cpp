// SPDX-License-Identifier: MIT
#include "stereo_slam/results/result_streams.hpp"

#include <algorithm>
#include <functional>
#include <sstream>
#include <string_view>
#include <utility>

#include "stereo_slam/io/trajectory_io.hpp"
#include "stereo_slam/results/pose_frame.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

template <class Write>
[[nodiscard]] std::string text_of(const Write& write) {
  std::ostringstream stream;
  write(stream);
  return std::move(stream).str();
}

[[nodiscard]] bool holds_results(const fs::path& folder) {
  return std::any_of(result_files().begin(), result_files().end(),
                     [&](const char* name) { return fs::exists(folder / name); });
}

}  // namespace

ResultStreams::ResultStreams(fs::path folder, std::optional<Eigen::Isometry3d> T_body_camera)
    : folder_(std::move(folder)),
      T_body_camera_(std::move(T_body_camera)),
      online_(folder_ / "trajectory_online.txt"),
      covariances_(folder_ / "covariances.csv"),
      timing_(folder_ / "timing.csv"),
      loops_(folder_ / "loops.csv") {
  if (!holds_results(folder_)) begin();
}

void ResultStreams::begin() {
  online_.replace("");
  covariances_.replace(text_of(write_covariances_header));
  timing_.replace(text_of([](std::ostream& out) { write_timing(out, {}); }));
  loops_.replace(text_of(write_loops_header));
  // These are written at the end of the run; until then, files of a killed run must not stay here.
  for (const char* name : {"trajectory_kitti.txt", "trajectory_tum.txt", "map.ply", "report.html"})
    fs::remove(folder_ / name);
  begun_ = true;
}

void ResultStreams::append_frame(const RunRecord& record) {
  if (!begun_) begin();
  const FrameResult result =
      T_body_camera_ ? in_body_frame(record.results.back(), *T_body_camera_) : record.results.back();
  online_.append(text_of([&](std::ostream& out) {
    write_tum_trajectory(out, {&result.stamp_ns, 1}, {&result.T_odometry_camera, 1});
  }));
  covariances_.append(text_of(
      [&](std::ostream& out) { write_covariances_row(out, result, result.T_world_camera.covariance); }));
  append_timing(record);
}

void ResultStreams::append_timing(const RunRecord& record) {
  const std::size_t last = record.results.size() - 1;
  const auto& times = record.results.back().times;
  const bool complete = std::ranges::all_of(
      times, [&](const StageTime& time) { return std::ranges::find(stages_, time.stage) != stages_.end(); });
  if (complete) {
    timing_.append(text_of([&](std::ostream& out) { write_timing_row(out, record, last, stages_); }));
    return;
  }
  stages_ = stage_names(record);  // a new stage adds a column, so the file is written again
  timing_.replace(text_of([&](std::ostream& out) { write_timing(out, record); }));
}

void ResultStreams::append_loops(std::span<const LoopEvent> loops) {
  if (loops.size() <= appended_loops_) return;
  loops_.append(text_of([&](std::ostream& out) {
    for (const auto& loop : loops.subspan(appended_loops_))
      write_loops_row(out, T_body_camera_ ? in_body_frame(loop, *T_body_camera_) : loop);
  }));
  appended_loops_ = loops.size();
}

void ResultStreams::sync() noexcept {
  for (auto* stream : {&online_, &covariances_, &loops_}) stream->sync();
}

}  // namespace stereo_slam
