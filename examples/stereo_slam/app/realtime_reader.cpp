// SPDX-License-Identifier: MIT
#include "stereo_slam/app/realtime_reader.hpp"

#include <utility>

namespace stereo_slam {

RealtimeReader::RealtimeReader(FrameReader::Load load, std::size_t count, Pace pace)
    : pace_(pace),
      reader_(std::move(load), count),
      thread_([this](const std::stop_token& stop) { offer_all(stop); }) {}

void RealtimeReader::offer_all(const std::stop_token& stop) {
  try {
    std::optional<std::int64_t> previous_ns;
    Clock::time_point due;
    while (auto read = reader_.next([&] { return stop.stop_requested(); })) {
      const std::int64_t stamp_ns = read->frame.stamp_ns;
      if (pace_ == Pace::kAsRead) {
        offer(std::move(*read), Clock::now(), stop);
      } else if (previous_ns) {
        due = not_before_now(due + std::chrono::nanoseconds(stamp_ns - *previous_ns));
        offer(std::move(*read), due, stop);
      } else {
        offer(std::move(*read), Clock::now(), stop);
        std::unique_lock lock(mutex_);
        changed_.wait(lock, stop, [&] { return !offered_; });
        due = Clock::now();
      }
      previous_ns = stamp_ns;
    }
  } catch (...) {
    const std::lock_guard lock(mutex_);
    failure_ = std::current_exception();
  }
  const std::lock_guard lock(mutex_);
  finished_ = true;
  changed_.notify_all();
}

/// The time at which a frame due at `due` is offered now that it has been read; adds up the delays.
RealtimeReader::Clock::time_point RealtimeReader::not_before_now(Clock::time_point due) {
  const auto now = Clock::now();
  if (now <= due) return due;
  reading_delay_ += now - due;
  return now;
}

/// Waits until `at`, then offers the frame. A frame that was offered before and not taken is dropped.
void RealtimeReader::offer(ReadFrame read, Clock::time_point at, const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  changed_.wait_until(lock, stop, at, [] { return false; });
  if (stop.stop_requested()) return;
  OfferedFrame next{.read = std::move(read),
                    .offered_at = at,
                    .reading_delay_s = std::chrono::duration<double>(reading_delay_).count()};
  if (offered_) {
    next.dropped_ns = std::move(offered_->dropped_ns);
    next.dropped_ns.push_back(offered_->read.frame.stamp_ns);
    next.read.cpu_ms += offered_->read.cpu_ms;
  }
  offered_ = std::move(next);
  changed_.notify_all();
}

std::optional<OfferedFrame> RealtimeReader::next(const std::function<bool()>& stop) {
  using namespace std::chrono_literals;
  std::unique_lock lock(mutex_);
  while (!stop()) {  // a signal handler cannot notify, so stop() is polled
    if (!changed_.wait_for(lock, 50ms, [&] { return offered_ || finished_; })) continue;
    if (!offered_ && failure_) std::rethrow_exception(failure_);
    changed_.notify_all();
    return std::exchange(offered_, std::nullopt);
  }
  return std::nullopt;
}

}  // namespace stereo_slam
