// SPDX-License-Identifier: MIT
#include "loop_closing.hpp"

#include <future>
#include <utility>

namespace stereo_slam {
struct LoopClosing::State {
  LoopSearch search;
  LoopThread thread;
  std::size_t latency_frames;
  std::future<std::optional<LoopCorrection>> running{};
  std::size_t running_due = 0;
  std::optional<LoopCorrection> ready{};
  std::size_t ready_due = 0;

  /// The search while nothing works on it.
  [[nodiscard]] const LoopSearch& at_rest() const {
    if (running.valid()) running.wait();
    return search;
  }

  /// Waits for the work at hand. Its correction contains any earlier one.
  void collect() {
    if (!running.valid()) return;
    auto correction = running.get();
    if (!correction) return;
    ready = std::move(correction);
    ready_due = running_due;
  }
};

LoopClosing::LoopClosing(const StereoCamera& camera, const Settings& settings, LoopThread thread)
    : state_(new State{.search = LoopSearch(camera, settings),
                       .thread = thread,
                       .latency_frames = static_cast<std::size_t>(settings.loop_closure.latency_frames)}) {}
LoopClosing::~LoopClosing() = default;
LoopClosing::LoopClosing(LoopClosing&&) noexcept = default;
LoopClosing& LoopClosing::operator=(LoopClosing&&) noexcept = default;

void LoopClosing::add_keyframe(Keyframe keyframe) {
  State& s = *state_;
  s.collect();
  s.running_due = keyframe.frame + s.latency_frames;
  const auto policy = s.thread == LoopThread::kOwn ? std::launch::async : std::launch::deferred;
  s.running = std::async(policy, [&search = s.search, keyframe = std::move(keyframe)]() mutable {
    return search.process(std::move(keyframe));
  });
}

std::optional<LoopCorrection> LoopClosing::correction_due(std::size_t frame) {
  State& s = *state_;
  if (s.running.valid() && frame >= s.running_due) s.collect();
  if (!s.ready || frame < s.ready_due) return std::nullopt;
  return std::exchange(s.ready, std::nullopt);
}

std::optional<LoopCorrection> LoopClosing::finish() {
  State& s = *state_;
  s.collect();
  if (auto last = s.search.correct()) s.ready = std::move(last);
  return std::exchange(s.ready, std::nullopt);
}

std::vector<LoopEvent> LoopClosing::events() const { return state_->at_rest().events(); }

std::size_t LoopClosing::memory_bytes() const { return state_->at_rest().memory_bytes(); }

}  // namespace stereo_slam
