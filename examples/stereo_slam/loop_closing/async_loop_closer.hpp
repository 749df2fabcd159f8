// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/keyframes/keyframe_database.hpp"
#include "stereo_slam/loop_closing/loop_closer.hpp"
#include "stereo_slam/settings/settings.hpp"

namespace stereo_slam {

/// Where loops are looked for and the pose graph is solved. The results are the same.
enum class LoopThread { kNone, kOwn };

/// From keyframes to corrections: recognition, verification, consistency, gate and pose graph (sec. IV-F).
///
/// Keyframes are worked on away from the caller, one after the other. What one brings takes effect a fixed
/// number of frames later, waiting if it has to: so the results depend on neither threads nor their speed.
class AsyncLoopCloser {
 public:
  /// `known`: what an earlier run left behind, or nothing.
  AsyncLoopCloser(const StereoCamera& camera, const Settings& settings, LoopThread thread,
                  const SavedMap& known = {}, MapUse use = MapUse::kContinue);
  ~AsyncLoopCloser();
  AsyncLoopCloser(AsyncLoopCloser&&) noexcept;
  AsyncLoopCloser& operator=(AsyncLoopCloser&&) noexcept;

  /// Hands over the newest keyframe, with its points and its pose relative to the one before.
  void add_keyframe(Keyframe keyframe);

  /// The correction that takes effect before `frame`; the caller moves its keyframes.
  [[nodiscard]] std::optional<LoopCorrection> correction_due(std::size_t frame);

  /// What is still to come when no more keyframes do. Loops that awaited the next optimisation are in it.
  [[nodiscard]] std::optional<LoopCorrection> finish();

  /// Loops found so far, accepted and refused, in order; complete after finish().
  [[nodiscard]] std::vector<LoopEvent> events() const;

  /// Adds keyframes and loops to a map, those known from the start first.
  void save(SavedMap& map) const;

  /// Of keyframes and recognition.
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace stereo_slam
