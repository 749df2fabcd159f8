// SPDX-License-Identifier: MIT
#include "stereo_slam/app/background_sync.hpp"

#include <utility>

namespace stereo_slam {

BackgroundSync::BackgroundSync(std::function<void()> sync)
    : thread_([this, sync = std::move(sync)](const std::stop_token& stop) { run(stop, sync); }) {}

void BackgroundSync::request() {
  const std::lock_guard lock(mutex_);
  requested_ = true;
  changed_.notify_one();
}

void BackgroundSync::run(const std::stop_token& stop, const std::function<void()>& sync) {
  while (true) {
    {
      std::unique_lock lock(mutex_);
      if (!changed_.wait(lock, stop, [&] { return requested_; })) return;
      requested_ = false;
    }
    sync();
  }
}

}  // namespace stereo_slam
