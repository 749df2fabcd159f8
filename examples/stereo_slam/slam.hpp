// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "camera/stereo_camera.hpp"
#include "loop_closing.hpp"
#include "settings.hpp"
#include "types.hpp"

namespace stereo_slam {

/// The stereo SLAM of the DQV-SLAM paper's Fig. 2. Frames go in one by one, in order; no input or output, and
/// no threads but the loops', which changes no result.
class Slam {
 public:
  Slam(const StereoCamera& camera, const Settings& settings, LoopThread loop_thread = LoopThread::kNone);
  ~Slam();
  Slam(Slam&&) noexcept;
  Slam& operator=(Slam&&) noexcept;

  /// Tracks one rectified frame and updates the map. Always returns a pose; its status says what it rests on.
  FrameResult process(const StereoFrame& frame);

  /// After the last frame: lets the loops take effect that are still being worked on.
  void finish();

  /// T_world_camera of every frame so far, as known now (a loop closure may have moved earlier ones).
  [[nodiscard]] std::vector<PoseEstimate> trajectory() const;

  /// All landmarks ever established, in world coordinates.
  [[nodiscard]] std::vector<MapPoint> map_points() const;

  /// Loops found, accepted or refused; complete after finish().
  [[nodiscard]] std::vector<LoopEvent> loop_events() const;

  /// Of what loop closure keeps of the keyframes; zero without it.
  [[nodiscard]] std::size_t keyframe_memory_bytes() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace stereo_slam
