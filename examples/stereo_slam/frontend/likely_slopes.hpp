// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// Slopes of the disparity that common surfaces through a point have: one that faces the camera, a horizontal
/// one, and a vertical one along the optical axis.
class LikelySlopes {
 public:
  LikelySlopes(const StereoPoint& z, const StereoCamera& camera) {
    constexpr double kSteepest = 0.8;  // steeper surfaces are hardly visible
    add(Vector2<double>::Zero());
    const double horizontal = z.z() / (z.y() - camera.cy);
    if (horizontal > 0.0 && horizontal < kSteepest) add({0.0, horizontal});
    const double vertical = z.z() / (z.x() - camera.cx);
    if (std::abs(vertical) < kSteepest) add({vertical, 0.0});
  }

  [[nodiscard]] std::span<const Vector2<double>> all() const { return {slopes_.data(), count_}; }

  /// Whether a slope is one of these, up to the noise of the measurement.
  [[nodiscard]] bool contain(const Vector2<double>& slope) const {
    constexpr double kAlike = 0.05;
    const auto surfaces = all();
    return std::any_of(surfaces.begin(), surfaces.end(), [&](const Vector2<double>& likely) {
      return (slope - likely).cwiseAbs().maxCoeff() < kAlike;
    });
  }

 private:
  void add(const Vector2<double>& slope) { slopes_[count_++] = slope; }

  std::array<Vector2<double>, 3> slopes_;
  std::size_t count_ = 0;
};

}  // namespace stereo_slam
