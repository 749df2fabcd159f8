// SPDX-License-Identifier: MIT
#include "runner.hpp"

#include <algorithm>
#include <chrono>

#include <fmt/format.h>
#include <opencv2/core/utility.hpp>

#include "association_trace.hpp"
#include "debug_image.hpp"
#include "frame_reader.hpp"
#include "map_file.hpp"
#include "output.hpp"
#include "progress.hpp"
#include "signals.hpp"
#include "slam.hpp"
#include "view.hpp"

namespace stereo_slam {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Processes frames until the last one, a signal or an error; returns the error's text.
std::string process_frames(const StereoSequence& sequence, std::size_t count, const ImageSettings& images,
                           const RunOptions& options, Slam& slam, std::optional<Viewer>& viewer,
                           const std::optional<DebugImages>& debug_images, RunRecord& record) {
  try {
    Progress progress(options.quiet);
    FrameReader reader(
        [&](std::size_t i) -> std::optional<StereoFrame> {
          try {
            return load_frame(sequence, i, images);
          } catch (const EndOfRecording&) {
            return std::nullopt;
          }
        },
        count);
    while (const auto frame = reader.next(SignalGuard::stop_requested)) {
      const auto start = Clock::now();
      AssociationTrace trace;
      FrameResult result = slam.process(*frame, debug_images ? &trace : nullptr);
      const double ms = 1e3 * seconds_since(start);
      progress.update(result.index + 1, count,
                      fmt::format("{} landmarks  {}", result.landmarks, to_string(result.status)));
      if (viewer) viewer->show(*frame, result, slam.map_points(), sequence.camera);
      if (debug_images) debug_images->write(*frame, result, trace);
      record.results.push_back(std::move(result));
      record.total_ms.push_back(ms);
    }
    slam.finish();
    return "";
  } catch (const std::exception& error) {
    return error.what();
  }
}

/// A map is made of keyframes, which the search for loops keeps.
void require_keyframes(const Settings& settings) {
  if (settings.loop_closure.enabled && settings.map.layout == MapLayout::kAnchored) return;
  throw std::runtime_error(
      "--save-map and --load-map need loop closure and the anchored layout; use the default preset");
}

/// With the loaded map, if there is one. What the map does not fit names its file.
Slam make_slam(const StereoSequence& sequence, const Settings& settings, const RunOptions& options,
               const SavedMap& known) {
  const auto thread = options.threads == 1 ? LoopThread::kNone : LoopThread::kOwn;
  if (!options.load_map) return Slam(sequence.camera, settings, thread);
  require_keyframes(settings);
  if (known.keyframes.empty()) {
    throw std::runtime_error(
        fmt::format("{}: the map is empty; load one of a longer run", options.load_map->string()));
  }
  try {
    return Slam(sequence.camera, settings, thread, known,
                options.save_map ? MapUse::kContinue : MapUse::kLocalise);
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(fmt::format("{}: {}", options.load_map->string(), error.what()));
  }
}

}  // namespace

RunSummary run(const StereoSequence& sequence, const Settings& settings, const RunOptions& options) {
  std::optional<Eigen::Isometry3d> T_body_camera;
  if (options.pose_frame == PoseFrame::kBody) T_body_camera = require_body(sequence);
  if (options.threads) cv::setNumThreads(*options.threads);
  if (options.save_map) require_keyframes(settings);
  const SavedMap known = options.load_map ? load_map(*options.load_map) : SavedMap{};
  const std::size_t count =
      std::min(sequence.frames.size(), options.max_frames.value_or(sequence.frames.size()));
  std::optional<Viewer> viewer;
  if (options.view) viewer.emplace();
  std::optional<DebugImages> debug_images;
  if (options.debug_images) debug_images.emplace(*options.debug_images);
  const std::string pose_frame = T_body_camera ? "body" : "camera";
  Slam slam = make_slam(sequence, settings, options, known);
  prepare_output_folder(options.output);
  write_run_yaml(options.output,
                 {.state = "running", .error = "", .frames_processed = 0, .pose_frame = pose_frame}, sequence,
                 settings);

  const SignalGuard signals;
  const auto start = Clock::now();
  RunRecord record;
  RunSummary summary;
  summary.error =
      process_frames(sequence, count, settings.images, options, slam, viewer, debug_images, record);
  summary.seconds = seconds_since(start);
  summary.interrupted = SignalGuard::stop_requested();
  summary.frames = record.results.size();
  summary.lost = static_cast<std::size_t>(
      std::count_if(record.results.begin(), record.results.end(),
                    [](const FrameResult& result) { return result.status == TrackingStatus::kLost; }));
  summary.median_ms = median(record.total_ms);

  record.trajectory = slam.trajectory();
  record.trajectory.resize(record.results.size());
  record.map_points = slam.map_points();
  record.loops = slam.loop_events();
  summary.landmarks = record.map_points.size();
  if (T_body_camera) record = in_body_frame(std::move(record), *T_body_camera);
  const auto attempt = [&summary](const auto& write) {
    try {
      write();
    } catch (const std::exception& error) {
      if (summary.error.empty()) summary.error = error.what();
    }
  };
  attempt([&] { write_results(options.output, record); });
  if (options.save_map) attempt([&] { save_map(*options.save_map, slam.saved_map()); });
  const auto* state = !summary.error.empty() ? "failed" : summary.interrupted ? "interrupted" : "finished";
  write_run_yaml(options.output, {state, summary.error, summary.frames, summary.seconds, pose_frame},
                 sequence, settings);
  return summary;
}

}  // namespace stereo_slam
