// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <vector>

#include "camera/stereo_camera.hpp"
#include "settings.hpp"
#include "types.hpp"

namespace stereo_slam {

/// The stereo SLAM of the DQV-SLAM paper's Fig. 2. Frames go in one by one, in order; no threads, no input or
/// output.
class Slam {
 public:
  Slam(const StereoCamera& camera, const Settings& settings);
  ~Slam();
  Slam(Slam&&) noexcept;
  Slam& operator=(Slam&&) noexcept;

  /// Tracks one rectified frame and updates the map. Always returns a pose; its status says what it rests on.
  FrameResult process(const StereoFrame& frame);

  /// T_world_camera of every frame so far, as known now (a loop closure may have moved earlier ones).
  [[nodiscard]] std::vector<PoseEstimate> trajectory() const;

  /// All landmarks ever established, in world coordinates.
  [[nodiscard]] std::vector<MapPoint> map_points() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace stereo_slam
