// SPDX-License-Identifier: MIT
#include "stereo_slam/ros2_output/mcap_recording.hpp"

#include <chrono>
#include <stdexcept>
#include <string>
#include <utility>

#include "stereo_slam/core/parallel.hpp"
#include "stereo_slam/io/file_error.hpp"
#include "stereo_slam/report/thumbnails.hpp"

namespace stereo_slam {
namespace {

/// The keyframes of the run so far and its last frame.
[[nodiscard]] std::vector<StampedPose> path_of(const RunRecord& record,
                                               const std::vector<PoseGaussian>& trajectory) {
  std::vector<StampedPose> path;
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    if (record.results[i].is_keyframe || i + 1 == trajectory.size())
      path.push_back({record.results[i].stamp_ns, trajectory[i].pose});
  }
  return path;
}

}  // namespace

std::vector<Vector3<float>> NewLandmarks::take(const std::vector<MapPoint>& points, bool moved) {
  if (moved) looked_at_ = 0;
  std::vector<Vector3<float>> result;
  for (; looked_at_ < points.size(); ++looked_at_) {
    const MapPoint& point = points[looked_at_];
    if (point.landmark >= taken_.size()) taken_.resize(2 * std::size_t{point.landmark} + 1);
    if (taken_[point.landmark]) continue;
    taken_[point.landmark] = point.landmark != 0;
    result.emplace_back(point.position_world.cast<float>());
  }
  return result;
}

McapRecording::McapRecording(const McapOptions& options, const StereoSequence& sequence)
    : with_images_(options.with_images),
      file_(options),
      writer_([this](std::string_view bytes) { file_.append(bytes); },
              std::string(kMcapLibrary) + STEREO_SLAM_VERSION),
      messages_(writer_, sequence.T_body_camera, with_images_,
                sequence.imu ? std::optional(sequence.imu->sensor.T_camera_imu) : std::nullopt),
      thread_([this](const std::stop_token& stop) { run(stop); }) {}

McapRecording::~McapRecording() = default;

void McapRecording::append(const StereoFrame& frame, const RunRecord& record, SlamSystem& slam) {
  constexpr std::size_t kMostWaiting = 100;  // frames; beyond that the disk is too slow, and the run waits
  Task task{.frame = {.result = record.results.back(), .total_ms = record.total_ms.back()},
            .image = with_images_ && frame.has_left() ? frame.left : cv::Mat()};
  const std::size_t frames = record.results.size();
  path_moved_ = path_moved_ || task.frame.result.loop_corrected;
  const bool writes_path = path_moved_ && path_interval_.is_due(frames);
  if (writes_path) {
    task.frame.path = path_of(record, slam.trajectory());
    path_interval_.done(frames);
  }
  if (writes_path || (task.frame.result.is_keyframe && !path_moved_))
    task.frame.new_landmarks_world = new_landmarks_.take(slam.archived_map_points(), writes_path);
  if (writes_path) path_moved_ = false;
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return tasks_.size() < kMostWaiting || failure_; });
  if (failure_) return;
  tasks_.push_back(std::move(task));
  changed_.notify_all();
}

void McapRecording::finish(const RunRecord& record) {
  thread_.request_stop();
  if (thread_.joinable()) thread_.join();
  try {
    if (failure_) std::rethrow_exception(failure_);
    std::vector<Vector3<float>> map;
    for (const auto& point : record.map_points) map.emplace_back(point.position_world.cast<float>());
    messages_.add_final(path_of(record, record.trajectory), map);
    writer_.end();
    file_.sync();
  } catch (const std::invalid_argument& error) {
    fail(file_.path(), "cannot be written ({})", error.what());
  }
  file_.require_in_place();
  if (record.results.empty()) file_.discard();
}

/// Writes the frames that are handed over. A chunk ends after a second even if no frame comes.
void McapRecording::run(const std::stop_token& stop) {
  using Clock = std::chrono::steady_clock;
  constexpr std::chrono::seconds kLongestChunk{1};
  lower_thread_priority();
  Clock::time_point chunk_ends = Clock::now() + kLongestChunk;
  try {
    while (true) {
      std::deque<Task> tasks;
      {
        std::unique_lock lock(mutex_);
        (void)changed_.wait_until(lock, stop, chunk_ends, [&] { return !tasks_.empty(); });
        tasks.swap(tasks_);
        changed_.notify_all();
      }
      for (auto& task : tasks) write(task);
      if (tasks.empty() && stop.stop_requested()) return;
      if (Clock::now() < chunk_ends) continue;
      end_chunk();
      chunk_ends = Clock::now() + kLongestChunk;
    }
  } catch (...) {
    const std::lock_guard lock(mutex_);
    failure_ = std::current_exception();
    tasks_.clear();
    changed_.notify_all();
  }
}

void McapRecording::write(Task& task) {
  constexpr std::size_t kLargestChunk_bytes = 1'000'000;
  if (!task.image.empty()) task.frame.jpeg = report::to_jpeg(report::small_image(task.image));
  messages_.add(task.frame);
  if (writer_.chunk_bytes() >= kLargestChunk_bytes) end_chunk();
}

void McapRecording::end_chunk() {
  writer_.end_chunk();
  file_.sync();
}

}  // namespace stereo_slam
