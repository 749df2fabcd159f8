// SPDX-License-Identifier: MIT
#include "stereo_slam/loop_closing/async_loop_closer.hpp"

#include <algorithm>
#include <chrono>
#include <iterator>
#include <limits>
#include <utility>

#include "stereo_slam/core/parallel.hpp"

namespace stereo_slam {

AsyncLoopCloser::AsyncLoopCloser(const StereoCamera& camera, const Settings& settings, LoopThread thread,
                                 const SavedMap& loaded, MapUse use)
    : closer_(camera, settings, loaded, use),
      thread_(thread),
      keyframes_(use == MapUse::kContinue ? loaded.keyframes.size() : 0) {}

/// Waits until all tasks are done and returns the loop closer.
const LoopCloser& AsyncLoopCloser::at_rest() const {
  if (!tasks_.empty()) tasks_.back().correction.wait();
  return closer_;
}

void AsyncLoopCloser::add_keyframe(Keyframe keyframe, cv::Mat left, const LensResidual& lens,
                                   CorrectionDelay delay) {
  // The time to optimise a pose graph is proportional to its size.
  constexpr std::size_t kKeyframesPerFrame = 50;
  constexpr std::size_t kShortDelay_frames = 3;
  const std::size_t usual_delay = kCorrectionLatency_frames + keyframes_++ / kKeyframesPerFrame;
  const std::size_t due =
      keyframe.frame +
      (delay == CorrectionDelay::kUsual ? usual_delay : std::min(usual_delay, kShortDelay_frames));
  const auto policy = thread_ == LoopThread::kOwn ? std::launch::async : std::launch::deferred;
  auto before = tasks_.empty() ? FutureCorrection{} : tasks_.back().correction;
  auto work = [this, before = std::move(before), keyframe = std::move(keyframe), left = std::move(left),
               lens]() mutable {
    if (thread_ == LoopThread::kOwn) lower_thread_priority();
    if (!left.empty()) describe(keyframe.points, left, lens);
    left.release();
    if (before.valid()) before.wait();
    before = {};  // frees its result
    return closer_.process(std::move(keyframe));
  };
  tasks_.push_back({std::async(policy, std::move(work)).share(), due});
}

/// Waits for the tasks that are due, and takes those before them, too. A correction contains any earlier one.
std::optional<LoopCorrection> AsyncLoopCloser::correction_due(std::size_t frame) {
  const auto last_due =
      std::find_if(tasks_.rbegin(), tasks_.rend(), [&](const Task& task) { return task.due <= frame; });
  std::optional<LoopCorrection> latest;
  for (auto count = std::distance(last_due, tasks_.rend()); count > 0; --count) {
    auto correction = tasks_.front().correction.get();
    if (correction) latest = std::move(correction);
    tasks_.pop_front();
  }
  return latest;
}

std::optional<LoopCorrection> AsyncLoopCloser::finish(const std::vector<KeyframeLink>& links) {
  auto latest = correction_due(std::numeric_limits<std::size_t>::max());
  closer_.replace(links);
  if (auto last = closer_.correct()) latest = std::move(last);
  return latest;
}

std::optional<std::span<const LoopEvent>> AsyncLoopCloser::events_if_idle() const {
  using namespace std::chrono_literals;
  const bool works = !tasks_.empty() && tasks_.back().correction.wait_for(0s) == std::future_status::timeout;
  if (works) return std::nullopt;
  return closer_.events();
}

}  // namespace stereo_slam
