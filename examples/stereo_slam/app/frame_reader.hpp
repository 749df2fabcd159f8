// SPDX-License-Identifier: MIT
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>

#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// A frame, and what reading it took.
struct ReadFrame {
  StereoFrame frame;
  double cpu_ms = 0.0;  ///< CPU time of the reading thread
};

/// Reads frames ahead in its own thread, in order, and buffers at most kCapacity.
class FrameReader {
 public:
  using Load = std::function<std::optional<StereoFrame>(std::size_t)>;

  /// The reading thread calls `load` with 0, 1 ... count - 1. If `load` returns nothing, the recording ends
  /// there; if `load` throws, next() rethrows the exception.
  FrameReader(Load load, std::size_t count);

  /// The next frame; nothing after the last one, or as soon as `stop` returns true. Rethrows the exception of
  /// a load in place of its frame.
  std::optional<ReadFrame> next(const std::function<bool()>& stop);

  static constexpr std::size_t kCapacity = 4;

 private:
  void read_all(const std::stop_token& stop, const Load& load, std::size_t count);

  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<ReadFrame> frames_;
  std::exception_ptr failure_;
  bool finished_ = false;
  std::jthread thread_;  // last: ends before what it uses
};

}  // namespace stereo_slam
