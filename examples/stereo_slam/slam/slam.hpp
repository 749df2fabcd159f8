// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/loop_closing/async_loop_closer.hpp"
#include "stereo_slam/loop_closing/saved_map.hpp"
#include "stereo_slam/settings/settings.hpp"

namespace stereo_slam {

struct AssociationTrace;

/// The stereo SLAM of the DQV-SLAM paper's Fig. 2. Frames go in one by one, in order; no input or output, and
/// no threads but the loops', which changes no result.
class Slam {
 public:
  Slam(const StereoCamera& camera, const Settings& settings, LoopThread loop_thread = LoopThread::kNone);

  /// Starts with the map of an earlier run. Poses are relative to this run's first camera, and their status
  /// is kWeak, until its place in the map is found (status kRelocalised), then to the map's. Throws
  /// std::invalid_argument for settings without loops, by which the place would be found, and for a map of
  /// another camera.
  Slam(const StereoCamera& camera, const Settings& settings, LoopThread loop_thread, const SavedMap& known,
       MapUse use);
  ~Slam();
  Slam(Slam&&) noexcept;
  Slam& operator=(Slam&&) noexcept;

  /// Tracks one rectified frame and updates the map. Always returns a pose; its status says what it rests on.
  /// A `trace` is filled with how landmarks were looked for, if they were.
  FrameResult process(const StereoFrame& frame, AssociationTrace* trace = nullptr);

  /// After the last frame: lets the loops take effect that are still being worked on.
  void finish();

  /// T_world_camera of every frame so far, as known now (a loop closure may have moved earlier ones).
  [[nodiscard]] std::vector<PoseGaussian> trajectory() const;

  /// All landmarks ever established, in world coordinates; with those of a loaded map once the run has found
  /// its place in it.
  [[nodiscard]] std::vector<MapPoint> map_points() const;

  /// The map, the one that it started with included, for a later run; complete after finish(). Throws
  /// std::logic_error without loop closure, which keeps the keyframes.
  [[nodiscard]] SavedMap saved_map() const;

  /// Loops found, accepted or refused; complete after finish().
  [[nodiscard]] std::vector<LoopEvent> loop_events() const;

  /// Of what loop closure keeps of the keyframes; zero without it.
  [[nodiscard]] std::size_t keyframe_memory_bytes() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace stereo_slam
