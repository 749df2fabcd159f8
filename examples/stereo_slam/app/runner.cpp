// SPDX-License-Identifier: MIT
#include "stereo_slam/app/runner.hpp"

#include <algorithm>
#include <chrono>
#include <functional>

#include <fmt/format.h>
#include <opencv2/core/utility.hpp>

#include "stereo_slam/app/frame_reader.hpp"
#include "stereo_slam/app/process_memory.hpp"
#include "stereo_slam/app/progress.hpp"
#include "stereo_slam/app/signals.hpp"
#include "stereo_slam/io/text_file.hpp"
#include "stereo_slam/report/report.hpp"
#include "stereo_slam/results/map_file.hpp"
#include "stereo_slam/results/output.hpp"
#include "stereo_slam/slam/slam.hpp"
#include "stereo_slam/tracking/association_trace.hpp"
#include "stereo_slam/visualization/debug_image.hpp"
#include "stereo_slam/visualization/view.hpp"

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
      if (viewer) viewer->show(*frame, result, slam.archived_map_points(), sequence.camera);
      if (debug_images) debug_images->write(*frame, result, trace);
      record.results.push_back(std::move(result));
      record.total_ms.push_back(ms);
      record.resident_mb.push_back(resident_memory_mb());
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

/// What the SLAM knows at the end.
void conclude(const Slam& slam, RunRecord& record) {
  record.trajectory = slam.trajectory();
  record.trajectory.resize(record.results.size());
  record.map_points = slam.map_points();
  record.loops = slam.loop_events();
}

std::size_t frames_with(const RunRecord& record, const std::function<bool(const FrameResult&)>& property) {
  return static_cast<std::size_t>(std::count_if(record.results.begin(), record.results.end(), property));
}

RunSummary summary_of(const RunRecord& record) {
  RunSummary summary;
  summary.frames = record.results.size();
  summary.lost = frames_with(record, [](const FrameResult& result) {
    const bool began_the_map = result.is_keyframe;
    return result.status == TrackingStatus::kLost ||
           (result.status == TrackingStatus::kInitializing && !began_the_map);
  });
  summary.landmarks = record.map_points.size();
  summary.median_ms = median(record.total_ms);
  return summary;
}

std::size_t bytes_per_keyframe(const Slam& slam, const RunRecord& record) {
  const std::size_t keyframes = frames_with(record, &FrameResult::is_keyframe);
  return keyframes > 0 ? slam.keyframe_memory_bytes() / keyframes : 0;
}

/// Leaves the map for a later run; if it cannot be written that is the run's error, unless it has one.
void leave_map(const Slam& slam, const std::filesystem::path& file, RunHeader& header) {
  try {
    save_map(file, slam.saved_map());
  } catch (const std::exception& error) {
    if (header.error.empty()) header.error = error.what();
  }
}

/// Writes all files; what cannot be written becomes the run's error, unless it has one. The report shows the
/// camera's run, whatever the others hold.
void save(const std::filesystem::path& folder, const RunRecord& record,
          const std::optional<Eigen::Isometry3d>& T_body_camera, RunHeader& header,
          const StereoSequence& sequence, const Settings& settings) {
  const auto attempt = [&](const std::function<void()>& write) {
    try {
      write();
    } catch (const std::runtime_error& error) {
      if (header.error.empty()) header.error = error.what();
      header.state = "failed";
    }
  };
  std::optional<RunRecord> of_body;
  if (T_body_camera) of_body = in_body_frame(record, *T_body_camera);
  attempt([&] { write_results(folder, of_body ? *of_body : record); });
  header.peak_mb = peak_resident_memory_mb();
  attempt([&] {
    write_file(folder / "report.html", [&](std::ostream& out) {
      report::write_report(out, record,
                           {header, std::filesystem::absolute(sequence.folder).string(), settings.preset});
    });
  });
  write_run_yaml(folder, header, sequence, settings);
}

}  // namespace

RunSummary run(const StereoSequence& sequence, const Settings& settings, const RunOptions& options) {
  std::optional<Eigen::Isometry3d> T_body_camera;
  if (options.pose_frame == PoseFrame::kBody) T_body_camera = require_body(sequence);
  if (options.threads) cv::setNumThreads(*options.threads);
  if (options.save_map) {
    require_keyframes(settings);
    require_writable(*options.save_map);
  }
  const SavedMap known = options.load_map ? load_map(*options.load_map) : SavedMap{};
  const std::size_t count =
      std::min(sequence.frames.size(), options.max_frames.value_or(sequence.frames.size()));
  std::optional<Viewer> viewer;
  if (options.view) viewer.emplace();
  std::optional<DebugImages> debug_images;
  if (options.debug_images) debug_images.emplace(*options.debug_images);
  Slam slam = make_slam(sequence, settings, options, known);
  RunHeader header{.state = "running", .error = "", .pose_frame = T_body_camera ? "body" : "camera"};
  prepare_output_folder(options.output);
  write_run_yaml(options.output, header, sequence, settings);

  const SignalGuard signals;
  const auto start = Clock::now();
  RunRecord record;
  header.error =
      process_frames(sequence, count, settings.images, options, slam, viewer, debug_images, record);
  header.seconds = seconds_since(start);
  const bool interrupted = SignalGuard::stop_requested();
  conclude(slam, record);
  if (options.save_map) leave_map(slam, *options.save_map, header);
  header.frames_processed = record.results.size();
  header.bytes_per_keyframe = bytes_per_keyframe(slam, record);
  RunSummary summary = summary_of(record);

  header.state = !header.error.empty() ? "failed" : interrupted ? "interrupted" : "finished";
  save(options.output, record, T_body_camera, header, sequence, settings);

  summary.seconds = header.seconds;
  summary.interrupted = interrupted;
  summary.error = header.error;
  return summary;
}

}  // namespace stereo_slam
