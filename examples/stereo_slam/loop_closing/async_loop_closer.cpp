// SPDX-License-Identifier: MIT
#include "stereo_slam/loop_closing/async_loop_closer.hpp"

#include <algorithm>
#include <chrono>
#include <deque>
#include <future>
#include <iterator>
#include <limits>
#include <utility>

#include "stereo_slam/core/parallel.hpp"

namespace stereo_slam {
struct AsyncLoopCloser::State {
  /// Processing of one keyframe, and the frame before which its correction takes effect.
  struct Task {
    std::shared_future<std::optional<LoopCorrection>> correction;
    std::size_t due = 0;
  };

  LoopCloser closer;
  LoopThread thread;
  std::size_t latency_frames;
  std::size_t keyframes;     // of the pose graph that may move
  std::deque<Task> tasks{};  // in order; each waits for the one before

  /// Waits until all tasks are done and returns the loop closer.
  [[nodiscard]] const LoopCloser& at_rest() const {
    if (!tasks.empty()) tasks.back().correction.wait();
    return closer;
  }

  /// Whether the thread of the loops is at work.
  [[nodiscard]] bool is_working() const {
    using namespace std::chrono_literals;
    return !tasks.empty() && tasks.back().correction.wait_for(0s) == std::future_status::timeout;
  }

  /// Waits for the tasks that are due, and takes those before them, too. A correction contains any earlier
  /// one.
  [[nodiscard]] std::optional<LoopCorrection> collect(std::size_t frame) {
    const auto last_due =
        std::find_if(tasks.rbegin(), tasks.rend(), [&](const Task& task) { return task.due <= frame; });
    std::optional<LoopCorrection> latest;
    for (auto count = std::distance(last_due, tasks.rend()); count > 0; --count) {
      auto correction = tasks.front().correction.get();
      if (correction) latest = std::move(correction);
      tasks.pop_front();
    }
    return latest;
  }
};

AsyncLoopCloser::AsyncLoopCloser(const StereoCamera& camera, const Settings& settings, LoopThread thread,
                                 const SavedMap& loaded, MapUse use)
    : state_(new State{.closer = LoopCloser(camera, settings, loaded, use),
                       .thread = thread,
                       .latency_frames = static_cast<std::size_t>(kCorrectionLatency_frames),
                       .keyframes = use == MapUse::kContinue ? loaded.keyframes.size() : 0}) {}
AsyncLoopCloser::~AsyncLoopCloser() = default;
AsyncLoopCloser::AsyncLoopCloser(AsyncLoopCloser&&) noexcept = default;
AsyncLoopCloser& AsyncLoopCloser::operator=(AsyncLoopCloser&&) noexcept = default;

void AsyncLoopCloser::add_keyframe(Keyframe keyframe, cv::Mat left, const LensResidual& lens,
                                   CorrectionDelay delay) {
  State& s = *state_;
  // The time to optimise a pose graph is proportional to its size.
  constexpr std::size_t kKeyframesPerFrame = 50;
  constexpr std::size_t kShortDelay_frames = 3;
  const std::size_t usual_delay = s.latency_frames + s.keyframes++ / kKeyframesPerFrame;
  const std::size_t due =
      keyframe.frame +
      (delay == CorrectionDelay::kUsual ? usual_delay : std::min(usual_delay, kShortDelay_frames));
  const auto policy = s.thread == LoopThread::kOwn ? std::launch::async : std::launch::deferred;
  auto before = s.tasks.empty() ? decltype(State::Task::correction){} : s.tasks.back().correction;
  auto work = [&closer = s.closer, before = std::move(before), keyframe = std::move(keyframe),
               left = std::move(left), lens, own_thread = s.thread == LoopThread::kOwn]() mutable {
    if (own_thread) lower_thread_priority();
    if (!left.empty()) describe(keyframe.points, left, lens);
    left.release();
    if (before.valid()) before.wait();
    before = {};  // frees its result
    return closer.process(std::move(keyframe));
  };
  s.tasks.push_back({std::async(policy, std::move(work)).share(), due});
}

std::optional<LoopCorrection> AsyncLoopCloser::correction_due(std::size_t frame) {
  return state_->collect(frame);
}

std::optional<LoopCorrection> AsyncLoopCloser::finish(const std::vector<KeyframeLink>& links) {
  auto latest = state_->collect(std::numeric_limits<std::size_t>::max());
  state_->closer.replace(links);
  if (auto last = state_->closer.correct()) latest = std::move(last);
  return latest;
}

std::vector<LoopEvent> AsyncLoopCloser::events() const { return state_->at_rest().events(); }

std::optional<std::span<const LoopEvent>> AsyncLoopCloser::events_if_idle() const {
  if (state_->is_working()) return std::nullopt;
  return state_->closer.events();
}

void AsyncLoopCloser::save(SavedMap& map) const { state_->at_rest().save(map); }

std::size_t AsyncLoopCloser::memory_bytes() const { return state_->at_rest().memory_bytes(); }

}  // namespace stereo_slam
