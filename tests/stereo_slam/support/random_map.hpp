// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <random>
#include <vector>

#include "stereo_slam/loop_closing/saved_map.hpp"
#include "stereo_slam/support/scenes.hpp"

/// Maps of random values, for tests of code that stores them.
namespace stereo_slam::test {

/// A car's pose; the errors of pitch and height correlate.
inline PoseGaussian estimate(double forward_m, double variance) {
  PoseGaussian result{car_motion(forward_m), variance * Matrix6<double>::Identity()};
  result.covariance(0, 4) = result.covariance(4, 0) = 0.25 * variance;
  return result;
}

inline std::vector<KeyframePoint> points_of(std::size_t count, std::mt19937_64& random) {
  std::vector<KeyframePoint> points(count);
  for (auto& point : points) {
    point.z = random_measurement(random, kitti_camera(), 5.0, 80.0).cast<float>();
    for (auto& byte : point.descriptor) byte = static_cast<std::uint8_t>(random());
    point.landmark = static_cast<std::uint32_t>(random() >> 33);
  }
  return points;
}

inline std::vector<Keyframe> keyframes_of(std::size_t count, std::size_t points, std::mt19937_64& random) {
  std::vector<Keyframe> keyframes(count);
  for (std::size_t id = 0; id < count; ++id) {
    const auto length_m = 0.9 * static_cast<double>(id);
    keyframes[id].id = id;
    keyframes[id].frame = 7 * id;
    keyframes[id].stamp_ns = static_cast<std::int64_t>(100'000'000 * id) - 50'000'000;
    keyframes[id].segment = id / 2;
    keyframes[id].points = points_of(points, random);
    if (id > 0) keyframes[id].T_previous_keyframe = estimate(0.9, 1e-4);
    keyframes[id].T_world_keyframe = estimate(length_m, 1e-3 * length_m);
    keyframes[id].path_length_m = length_m;
  }
  return keyframes;
}

/// A map with so many keyframes, so many points in each and two keyframes a segment; with a loop if there are
/// two keyframes.
inline SavedMap map_of(std::size_t keyframes, std::size_t points) {
  std::mt19937_64 random(11);
  SavedMap map;
  map.camera = kitti_camera();
  for (int i = 0; i < 12; ++i) map.rectification.coefficients(i / 6, i % 6) = 0.1 * i;
  map.rectification.row_information *= 4.0;
  map.rectification.row_vector.setLinSpaced(1.0, 6.0);
  map.rectification.disparity_information(1, 4) = map.rectification.disparity_information(4, 1) = 0.5;
  map.rectification.disparity_vector.setLinSpaced(-3.0, -2.0);
  map.keyframes = keyframes_of(keyframes, points, random);
  if (keyframes > 1) map.loops = {{0, keyframes - 1, estimate(0.1, 1e-2)}};
  if (keyframes > 0) map.points = {{{1.0, -2.0, 3.5}, 200, 0, 8}, {{0.1, 1e6, -0.0}, 7, keyframes - 1, 3}};
  return map;
}

}  // namespace stereo_slam::test
