// SPDX-License-Identifier: MIT
#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <exception>
#include <filesystem>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include <opencv2/core.hpp>

#include "stereo_slam/dataset/sequence.hpp"
#include "stereo_slam/results/output.hpp"
#include "stereo_slam/ros2_output/mcap_file.hpp"
#include "stereo_slam/ros2_output/run_messages.hpp"
#include "stereo_slam/slam/slam_system.hpp"

namespace stereo_slam {

/// Selects the landmarks of the map that were not taken before.
class NewLandmarks {
 public:
  /// `points` are those of SlamSystem::archived_map_points(). `moved` tells that they are not those of the
  /// last call with more behind them.
  [[nodiscard]] std::vector<Vector3<float>> take(const std::vector<MapPoint>& points, bool moved);

 private:
  std::vector<bool> taken_;  // by landmark
  std::size_t looked_at_ = 0;
};

/// Tells when what takes time in proportion to the run so far may be done again: each time that the run is
/// longer by a tenth. So the mean time per frame does not grow with the run.
class GrowingInterval {
 public:
  [[nodiscard]] bool is_due(std::size_t frames) const { return frames >= next_; }
  void done(std::size_t frames) { next_ = frames + 1 + frames / 10; }

 private:
  std::size_t next_ = 0;
};

/// Writes --mcap. A thread of its own makes the messages and compresses them: a chunk a second or a megabyte,
/// whichever comes first. An error does not end the run; finish() throws it.
class McapRecording {
 public:
  /// Creates the file. Throws std::runtime_error when that fails.
  McapRecording(const McapOptions& options, const StereoSequence& sequence);
  /// Ends the thread. Without finish() the file has no summary.
  ~McapRecording();
  McapRecording(const McapRecording&) = delete;
  McapRecording& operator=(const McapRecording&) = delete;

  /// Hands the last frame of the record to the thread.
  void append(const StereoFrame& frame, const RunRecord& record, SlamSystem& slam);

  /// Ends the file, with the final path and map of the record. Removes it if no frame was processed. Throws
  /// the first error, std::runtime_error.
  void finish(const RunRecord& record);

  /// Replaces the file of an earlier run. Throws std::runtime_error when that fails.
  void publish() { file_.publish(); }

  /// Where the file is, if it did not replace that of an earlier run.
  [[nodiscard]] std::optional<std::filesystem::path> beside() const { return file_.beside(); }

 private:
  struct Task {
    FrameOutput frame;
    cv::Mat image;  // left; empty without --mcap-images
  };

  void run(const std::stop_token& stop);
  void write(Task& task);
  void end_chunk();

  bool with_images_;
  McapFile file_;
  McapWriter writer_;
  RunMessages messages_;
  NewLandmarks new_landmarks_;
  GrowingInterval path_interval_;
  bool path_moved_ = false;  // a loop moved the path since it was written

  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<Task> tasks_;
  std::exception_ptr failure_;
  std::jthread thread_;  // last: ends before what it uses
};

}  // namespace stereo_slam
