// SPDX-License-Identifier: MIT
#include "stereo_slam/app/runner.hpp"

#include <algorithm>
#include <chrono>
#include <functional>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <opencv2/core/utility.hpp>

#include "stereo_slam/app/background_sync.hpp"
#include "stereo_slam/app/frame_reader.hpp"
#include "stereo_slam/app/live_view.hpp"
#include "stereo_slam/app/messages.hpp"
#include "stereo_slam/app/process_usage.hpp"
#include "stereo_slam/app/progress.hpp"
#include "stereo_slam/app/realtime_reader.hpp"
#include "stereo_slam/app/run_map.hpp"
#include "stereo_slam/app/signals.hpp"
#include "stereo_slam/imu/imu_recording.hpp"
#include "stereo_slam/io/counted.hpp"
#include "stereo_slam/io/file_error.hpp"
#include "stereo_slam/io/output_file.hpp"
#include "stereo_slam/report/report.hpp"
#include "stereo_slam/report/thumbnails.hpp"
#include "stereo_slam/results/output.hpp"
#include "stereo_slam/results/result_streams.hpp"
#include "stereo_slam/results/run_folder.hpp"
#include "stereo_slam/results/run_yaml.hpp"
#include "stereo_slam/ros2_output/mcap_recording.hpp"
#include "stereo_slam/slam/slam_system.hpp"
#include "stereo_slam/tracking/associate.hpp"
#include "stereo_slam/visualization/debug_image_folder.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// What a run processes: the first `frames` frames of a recording or a camera.
struct RunInput {
  const StereoSequence& sequence;
  const Settings& settings;
  const RunOptions& options;
  std::size_t frames;

  /// Nothing for a live camera without a limit: frames come until the user stops the run.
  [[nodiscard]] std::optional<std::size_t> total() const {
    return sequence.live && !options.max_frames ? std::nullopt : std::optional(frames);
  }
};

/// The window of --view and the images of --debug-images, if wanted, and the thumbnails of the report.
class FrameDisplay {
 public:
  FrameDisplay(const RunOptions& options, const StereoCamera& camera) {
    if (options.view) view_.emplace(camera);
    if (options.debug_images) debug_images_.emplace(*options.debug_images, options.overwrite, options.output);
  }

  [[nodiscard]] bool needs_trace() const { return debug_images_.has_value(); }

  void show(const StereoFrame& frame, const FrameResult& result, SlamSystem& slam,
            const AssociationTrace& trace) {
    if (view_) view_->show(frame, result, slam);
    if (debug_images_) debug_images_->write(frame, result, trace);
    thumbnails_.offer(frame);
  }

  /// Called once the run has finished.
  void publish() {
    if (debug_images_) debug_images_->publish();
  }

  [[nodiscard]] std::vector<report::Thumbnail> thumbnails() const { return thumbnails_.images(); }

 private:
  std::optional<LiveView> view_;
  std::optional<DebugImageFolder> debug_images_;
  report::Thumbnails thumbnails_;
};

/// The results that are written while the run goes on. `begin` is called before those of the first frame.
class LiveResults {
 public:
  LiveResults(const RunFolder& folder, const std::optional<Eigen::Isometry3d>& T_body_camera,
              std::function<void()> begin)
      : folder_(folder), begin_(std::move(begin)), streams_(folder.working(), T_body_camera) {}

  [[nodiscard]] bool begun() const { return streams_.begun(); }

  /// Writes the last frame of the record. After a keyframe, another thread flushes the files to the disk.
  void append(const RunRecord& record, const SlamSystem& slam) {
    folder_.require_in_place();
    if (record.results.size() == 1) begin_();
    streams_.append_frame(record);
    if (const auto loops = slam.loop_events_if_idle()) streams_.append_loops(*loops);
    if (record.results.back().is_keyframe) sync_.request();
  }

 private:
  const RunFolder& folder_;
  std::function<void()> begin_;
  ResultStreams streams_;
  BackgroundSync sync_{[this] { streams_.sync(); }};  // last: ends before what it uses
};

/// Frame `i` of the recording; nothing if a video ends before it. An image that cannot be read is black, or
/// with --strict an exception.
std::optional<StereoFrame> load_unless_ended(const RunInput& input, std::size_t i) {
  const auto load = input.options.strict ? load_frame : load_partial_frame;
  try {
    return load(input.sequence, i, input.settings.images);
  } catch (const EndOfRecording&) {
    return std::nullopt;
  }
}

/// Where the results of a frame go.
struct RunOutputs {
  FrameDisplay& display;
  Progress& progress;
  LiveResults& results;
  McapRecording* mcap;  ///< null without --mcap
  RunRecord& record;
};

/// Notes the images that the frame lacks. If one file or video frame holds both, it is noted once.
void note_faults(const StereoFrame& frame, RunRecord& record) {
  if (!frame.has_left()) record.unreadable.push_back({frame.index, frame.left_fault});
  if (!frame.has_right() && frame.right_fault != frame.left_fault)
    record.unreadable.push_back({frame.index, frame.right_fault});
}

/// Processes frames until `next` returns nothing. Processed frames are numbered without gaps, whether or not
/// frames were dropped.
void process_frames(const std::function<std::optional<OfferedFrame>()>& next, const RunInput& input,
                    SlamSystem& slam, RunOutputs& outputs) {
  RunRecord& record = outputs.record;
  std::optional<ImuFeed> imu;
  if (input.sequence.imu) imu.emplace(*input.sequence.imu);
  double cpu_ms = process_cpu_ms();
  while (auto offered = next()) {
    StereoFrame& frame = offered->read.frame;
    const std::size_t position = std::exchange(frame.index, record.results.size());
    note_faults(frame, record);
    if (imu) frame.imu = imu->until(frame.stamp_ns);
    const auto start = Clock::now();
    AssociationTrace trace;
    FrameResult result = slam.process(frame, outputs.display.needs_trace() ? &trace : nullptr);
    const double ms = 1e3 * seconds_since(start);
    const double latency_ms = 1e3 * seconds_since(offered->offered_at);
    outputs.display.show(frame, result, slam, trace);
    record.results.push_back(std::move(result));
    record.total_ms.push_back(ms);
    record.resident_mb.push_back(resident_memory_mb());
    record.read_cpu_ms.push_back(offered->read.cpu_ms);
    record.cpu_ms.push_back(process_cpu_ms() - cpu_ms);
    cpu_ms += record.cpu_ms.back();
    if (record.realtime) {
      record.realtime->frames.push_back({latency_ms, std::move(offered->dropped_ns)});
      record.realtime->reading_delay_s = offered->reading_delay_s;
    }
    outputs.results.append(record, slam);
    if (outputs.mcap != nullptr) outputs.mcap->append(frame, record, slam);
    const FrameResult& last = record.results.back();
    outputs.progress.update(
        position + 1, input.total(),
        fmt::format("{}  {}", counted(static_cast<std::size_t>(last.landmarks), "landmark"),
                    to_string(last.status)));
  }
}

/// Processes the recording to its end or until a signal. An exception that stops the run is passed on; the
/// record keeps the frames before it.
void process_recording(const RunInput& input, SlamSystem& slam, RunOutputs outputs) {
  const auto load = [&](std::size_t i) { return load_unless_ended(input, i); };
  if (outputs.record.realtime) {
    RealtimeReader reader(load, input.frames, input.sequence.live ? Pace::kAsRead : Pace::kStamps);
    process_frames([&] { return reader.next(SignalGuard::stop_requested); }, input, slam, outputs);
  } else {
    FrameReader reader(load, input.frames);
    const auto next = [&]() -> std::optional<OfferedFrame> {
      auto read = reader.next(SignalGuard::stop_requested);
      if (!read) return std::nullopt;
      return OfferedFrame{.read = std::move(*read), .offered_at = Clock::now()};
    };
    process_frames(next, input, slam, outputs);
  }
  slam.finish();
}

/// Throws std::runtime_error unless the stamps increase, by at most ten minutes from frame to frame.
void require_pace(const RunInput& input) {
  constexpr std::int64_t kLongestPause_ns = 600'000'000'000;
  const auto& frames = input.sequence.frames;
  for (std::size_t i = 1; i < std::min(frames.size(), input.frames); ++i) {
    const std::int64_t pause_ns = frames[i].stamp_ns - frames[i - 1].stamp_ns;
    if (pause_ns > kLongestPause_ns) {
      fail(input.sequence.folder,
           "frame {} is {:.4g} s later than the frame before it, and --realtime would wait for it; check the "
           "times, cut the recording there, or leave out --realtime",
           i, 1e-9 * static_cast<double>(pause_ns));
    }
    if (pause_ns > 0) continue;
    fail(input.sequence.folder,
         "frame {} has no later stamp than the frame before it, so --realtime cannot be used; add times or "
         "frame_rate_hz to the calibration, or leave out --realtime",
         i);
  }
}

/// T_body_camera if poses of the body are wanted. Throws std::runtime_error when the calibration does not
/// contain it.
std::optional<Eigen::Isometry3d> body_of(const StereoSequence& sequence, const RunOptions& options) {
  if (options.pose_frame != PoseFrame::kBody) return std::nullopt;
  return require_body(sequence);
}

/// Adds what the SLAM knows only at the end: final trajectory, map and loops.
void add_final_results(const SlamSystem& slam, RunRecord& record) {
  record.trajectory = slam.trajectory();
  record.trajectory.resize(record.results.size());
  const auto covariances = slam.relative_covariances();
  for (std::size_t k = 0; k < record.results.size(); ++k) {
    record.results[k].relative_covariance = covariances[k];
    record.results[k].calibration = slam.calibration_error();
  }
  record.map_points = slam.map_points();
  record.loops = slam.loop_events();
  record.rig = slam.rig();
  record.inertial = slam.inertial();
}

std::size_t bytes_per_keyframe(const SlamSystem& slam, const RunRecord& record) {
  const std::size_t keyframes = count_frames(record, &FrameResult::is_keyframe);
  return keyframes > 0 ? slam.keyframe_memory_bytes() / keyframes : 0;
}

/// Calls a step of the run. An exception becomes the run's error, unless the run has an earlier one. Returns
/// whether the step succeeded.
[[nodiscard]] bool attempt(RunHeader& header, const std::function<void()>& step) {
  try {
    step();
    return true;
  } catch (const std::exception& error) {
    if (header.error.empty()) header.error = as_message(text_of(error));
    header.state = "failed";
    return false;
  }
}

/// Writes all result files; a file that cannot be written does not prevent the others. The report always
/// shows poses of the camera. Returns whether all were written.
[[nodiscard]] bool save(const RunInput& input, const fs::path& folder, const RunRecord& record,
                        const std::vector<report::Thumbnail>& thumbnails, RunHeader& header) {
  const auto T_body_camera = body_of(input.sequence, input.options);
  const bool written = attempt(
      header, [&] { write_results(folder, T_body_camera ? in_body_frame(record, *T_body_camera) : record); });
  header.peak_mb = peak_resident_memory_mb();
  const bool reported = attempt(header, [&] {
    write_file(folder / "report.html", [&](std::ostream& out) {
      report::write_report(out, record,
                           {.header = header,
                            .dataset = full_name(input.sequence),
                            .preset = input.settings.preset,
                            .ground_truth = {.stamps_ns = input.sequence.ground_truth_ns,
                                             .poses = input.sequence.ground_truth},
                            .thumbnails = thumbnails});
    });
  });
  return written && reported;
}

/// Writes the results of a run that has ended, and replaces those of an earlier run if it finished. Returns
/// the folder in which the results are then.
[[nodiscard]] fs::path store(const RunInput& input, const RunFolder& folder, const RunRecord& record,
                             const std::vector<report::Thumbnail>& thumbnails, RunHeader& header) {
  const bool saved = save(input, folder.working(), record, thumbnails, header);
  const bool described =
      attempt(header, [&] { write_run_yaml(folder.working(), header, input.sequence, input.settings); });
  const bool complete = saved && described && header.state == "finished" && !record.results.empty();
  const bool published = complete && attempt(header, [&] { folder.publish(); });
  return published ? input.options.output : folder.working();
}

/// Ends the file of --mcap. Returns where it is, if it did not replace that of an earlier run.
[[nodiscard]] std::optional<fs::path> end_mcap(McapRecording& mcap, const RunRecord& record,
                                               RunHeader& header) {
  (void)attempt(header, [&] { mcap.finish(record); });
  if (header.state == "finished") (void)attempt(header, [&] { mcap.publish(); });
  return mcap.beside();
}

/// The largest number of frames that the run can process.
[[nodiscard]] std::size_t frames_of(const StereoSequence& sequence, const RunOptions& options) {
  const std::size_t there = sequence.live ? std::numeric_limits<std::size_t>::max() : sequence.frames.size();
  return std::min(there, options.max_frames.value_or(there));
}

}  // namespace

RunSummary run(const StereoSequence& sequence, const Settings& settings, const RunOptions& options) {
  const RunInput input{sequence, settings, options, frames_of(sequence, options)};
  // Errors that would only show when the results are written are looked for before the run starts.
  RunHeader header{
      .state = "running", .error = "", .pose_frame = body_of(sequence, options) ? "body" : "camera"};
  if (options.realtime) require_pace(input);
  if (!sequence.source) require_other_folder(options.output, "--output", sequence);  // else beside a video
  if (options.debug_images) require_other_folder(*options.debug_images, "--debug-images", sequence);
  EarlierFile earlier_map;
  if (options.save_map) {
    require_keyframes(settings);
    check_save_map(options);
    earlier_map = earlier_file(*options.save_map);
  }
  const auto mcap_options = checked_mcap(options);
  if (options.threads) cv::setNumThreads(*options.threads);
  const std::unique_ptr<SlamSystem> system = make_slam(sequence, settings, options);
  SlamSystem& slam = *system;
  if (options.right_delay && !slam.rig().right_delay) slam.begin_with_delay(*options.right_delay);
  const SignalGuard signals;
  const RunFolder folder(options.output, options.overwrite);
  FrameDisplay display(options, sequence.camera);
  std::optional<McapRecording> mcap;
  if (mcap_options) mcap.emplace(*mcap_options, sequence);
  const auto write_header = [&] { write_run_yaml(folder.working(), header, sequence, settings); };
  // That of an earlier run that did not finish stays with its frames, until this run has one.
  const bool is_new = !fs::exists(folder.working() / "run.yaml");
  if (is_new) write_header();
  std::optional<LiveResults> opened;
  if (!attempt(header, [&] { opened.emplace(folder, body_of(sequence, options), write_header); })) {
    if (is_new) (void)attempt(header, write_header);
    throw std::runtime_error(header.error);
  }
  LiveResults& results = *opened;

  const auto start = Clock::now();
  RunRecord record;
  if (options.realtime || sequence.live) record.realtime.emplace();
  const bool all_frames = attempt(header, [&] {
    Progress progress(options.quiet);
    process_recording(input, slam, {display, progress, results, mcap ? &*mcap : nullptr, record});
  });
  header.seconds = seconds_since(start);
  add_final_results(slam, record);
  RunSummary summary = summary_of(record);
  summary.all_frames = all_frames;
  summary.interrupted = SignalGuard::stop_requested() && !sequence.live;  // a live run ends by a signal
  if (!summary.interrupted) (void)attempt(header, [&] { require_tracked(summary); });
  if (header.state == "running") header.state = summary.interrupted ? "interrupted" : "finished";
  if (options.save_map) {
    (void)attempt(header, [&] {
      summary.map = write_map(options, slam.saved_map(), header.state == "finished", earlier_map);
    });
  }
  if (mcap) summary.mcap = end_mcap(*mcap, record, header);
  header.frames_processed = record.results.size();
  header.unreadable = record.unreadable;
  header.weak_frames_by_reason = summary.weak_frames_by_reason;
  header.rig = summary.rig;
  header.inertial = summary.inertial;
  header.frame_cost = frame_cost(record);
  header.realtime = realtime_summary(record);
  header.bytes_per_keyframe = bytes_per_keyframe(slam, record);
  summary.folder = folder.working();
  summary.saved = results.begun() ? summary.frames : 0;
  summary.folder_in_place = attempt(header, [&] { folder.require_in_place(); });
  if (header.state == "finished") (void)attempt(header, [&] { display.publish(); });
  if (summary.folder_in_place && results.begun())
    summary.folder = store(input, folder, record, display.thumbnails(), header);

  summary.peak_mb = peak_resident_memory_mb();
  summary.seconds = header.seconds;
  summary.error = header.error;
  return summary;
}

}  // namespace stereo_slam
