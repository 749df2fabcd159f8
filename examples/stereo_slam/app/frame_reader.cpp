// SPDX-License-Identifier: MIT
#include "stereo_slam/app/frame_reader.hpp"

#include <chrono>
#include <utility>

#include "stereo_slam/app/process_usage.hpp"
#include "stereo_slam/core/parallel.hpp"

namespace stereo_slam {

FrameReader::FrameReader(Load load, std::size_t count)
    : thread_([this, load = std::move(load), count](const std::stop_token& stop) {
        read_all(stop, load, count);
      }) {}

void FrameReader::read_all(const std::stop_token& stop, const Load& load, std::size_t count) {
  lower_thread_priority();
  try {
    for (std::size_t i = 0; i < count; ++i) {
      const double start_ms = thread_cpu_ms();
      std::optional<StereoFrame> frame = load(i);
      if (!frame) break;
      const double cpu_ms = thread_cpu_ms() - start_ms;
      std::unique_lock lock(mutex_);
      if (!changed_.wait(lock, stop, [&] { return frames_.size() < kCapacity; })) return;
      frames_.push_back({std::move(*frame), cpu_ms});
      changed_.notify_all();
    }
  } catch (...) {
    const std::lock_guard lock(mutex_);
    failure_ = std::current_exception();
  }
  const std::lock_guard lock(mutex_);
  finished_ = true;
  changed_.notify_all();
}

std::optional<ReadFrame> FrameReader::next(const std::function<bool()>& stop) {
  using namespace std::chrono_literals;
  std::unique_lock lock(mutex_);
  while (!stop()) {  // a signal handler cannot notify, so stop() is polled
    if (!changed_.wait_for(lock, 50ms, [&] { return !frames_.empty() || finished_; })) continue;
    if (frames_.empty()) {
      if (failure_) std::rethrow_exception(failure_);
      return std::nullopt;
    }
    ReadFrame frame = std::move(frames_.front());
    frames_.pop_front();
    changed_.notify_all();
    return frame;
  }
  return std::nullopt;
}

}  // namespace stereo_slam
