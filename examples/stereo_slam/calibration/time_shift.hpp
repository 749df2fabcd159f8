// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>

#include "stereo_slam/calibration/yaml_map.hpp"

namespace stereo_slam {

/// `timeshift_cam_imu` [s] as Kalibr defines it, in ns: added to stamps of the camera, it gives those of the
/// IMU. Nothing if the map has none. Throws std::runtime_error, which names file and line, for one beyond ten
/// seconds.
[[nodiscard]] inline std::optional<std::int64_t> read_time_shift_ns(const YamlMap& map) {
  constexpr const char* kKey = "timeshift_cam_imu";
  constexpr double kLargest_s = 10.0;
  if (!map.has(kKey)) return std::nullopt;
  const double shift_s = map.number(kKey);
  if (!(std::abs(shift_s) <= kLargest_s))
    map.fail(map.get({kKey}), "{} is {} s, but must be within {} s", kKey, shift_s, kLargest_s);
  return std::llround(1e9 * shift_s);
}

}  // namespace stereo_slam
