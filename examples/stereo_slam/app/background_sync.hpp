// SPDX-License-Identifier: MIT
#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

namespace stereo_slam {

/// Flushes results to the disk in its own thread, because a flush takes milliseconds.
class BackgroundSync {
 public:
  /// The thread calls `sync` after a request. All requests during a call cause one further call.
  explicit BackgroundSync(std::function<void()> sync);

  void request();

 private:
  void run(const std::stop_token& stop, const std::function<void()>& sync);

  std::mutex mutex_;
  std::condition_variable_any changed_;
  bool requested_ = false;
  std::jthread thread_;  // last: ends before what it uses
};

}  // namespace stereo_slam
