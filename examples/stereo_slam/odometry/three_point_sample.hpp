// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <random>

/// @file
/// Random minimal sets of RANSAC whose model needs three correspondences.
namespace stereo_slam {

/// Indices of three different correspondences.
using ThreePointSample = std::array<std::size_t, 3>;

/// Three of `count` correspondences, of which there are at least three.
[[nodiscard]] inline ThreePointSample draw_three(std::size_t count, std::mt19937_64& random) {
  ThreePointSample sample{};
  do {
    for (auto& i : sample) i = static_cast<std::size_t>(random() % count);
  } while (sample[0] == sample[1] || sample[1] == sample[2] || sample[0] == sample[2]);
  return sample;
}

/// Samples to draw so that one is free of outliers with a probability of 99.99 %.
[[nodiscard]] inline int sufficient_draws(double inlier_share) {
  constexpr double kMissed = 1e-4;
  const double clean = inlier_share * inlier_share * inlier_share;
  if (clean >= 1.0 - kMissed) return 1;
  return static_cast<int>(std::min(1e6, std::ceil(std::log(kMissed) / std::log1p(-clean))));
}

}  // namespace stereo_slam
