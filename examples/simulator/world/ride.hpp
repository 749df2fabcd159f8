// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "simulator/world/camera_path.hpp"

namespace stereo_slam::simulator {

/// What a bad road adds to the motion of the camera in a vehicle: it bounces, pitches and rolls about the
/// camera's axes.
///
/// Each is a sum of twelve waves with random phases and frequencies from 0.8 to 3 Hz, those of a body on its
/// springs. The two axles move independently, so that the standard deviation of the pitch is
/// 2 bounce / wheelbase, 0.74 mrad per mm; that of the roll is half of it. At 10 frames a second, 17 mm turn
/// a camera of KITTI's by 10 px of pitch from frame to frame (standard deviation).
struct Ride {
  double bounce_m = 0.0;  ///< standard deviation; [0, 0.2]

  static constexpr double kWheelbase_m = 2.7;
  [[nodiscard]] double pitch_rad() const { return 2.0 * bounce_m / kWheelbase_m; }
  [[nodiscard]] double roll_rad() const { return 0.5 * pitch_rad(); }
};

/// The path with the motion of the ride; the same for the same seed.
[[nodiscard]] CameraPath on_bad_road(const CameraPath& path, const Ride& ride, double fps,
                                     std::uint64_t seed);

}  // namespace stereo_slam::simulator
