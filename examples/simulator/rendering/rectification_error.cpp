// SPDX-License-Identifier: MIT
#include "simulator/rendering/rectification_error.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include <Eigen/Geometry>

#include "simulator/rendering/rig_disturbance.hpp"
#include "simulator/textures/random.hpp"

namespace stereo_slam::simulator {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// What displaces the points of the right image.
struct Causes {
  Vector3d rotation = Vector3d::Zero();  ///< rad, of the ideal axes in the real ones
  Vector2d principal_point_px = Vector2d::Zero();
  double k1 = 0.0;

  [[nodiscard]] Causes scaled(double factor) const {
    return {factor * rotation, factor * principal_point_px, factor * k1};
  }
};

/// Displacement of the distant point that the ideal camera sees at `px`.
[[nodiscard]] Vector2d displacement(const PinholeCamera& camera, const Causes& causes, const Vector2d& px) {
  const Vector3d ideal((px.x() - camera.cx) / camera.fx, (px.y() - camera.cy) / camera.fy, 1.0);
  const Vector2d real = (rotation_matrix(causes.rotation) * ideal).hnormalized();
  const Vector2d distorted = (1.0 + causes.k1 * real.squaredNorm()) * real;
  return Vector2d(camera.fx * distorted.x() + camera.cx, camera.fy * distorted.y() + camera.cy) +
         causes.principal_point_px - px;
}

/// Largest displacement on a grid over the image.
[[nodiscard]] double largest_displacement_px(const PinholeCamera& camera, const Causes& causes) {
  constexpr int kSteps = 8;
  double largest = 0.0;
  for (int row = 0; row <= kSteps; ++row) {
    for (int column = 0; column <= kSteps; ++column) {
      const Vector2d px(column * (camera.width_px - 1.0) / kSteps, row * (camera.height_px - 1.0) / kSteps);
      largest = std::max(largest, displacement(camera, causes, px).norm());
    }
  }
  return largest;
}

/// Causes of comparable effect: each term alone displaces the border by up to about a pixel.
[[nodiscard]] Causes drawn(const PinholeCamera& camera, std::uint64_t seed) {
  constexpr std::uint64_t kStream = 77;
  Random random(seed, kStream);
  const auto share = [&] { return random.uniform(-1.0, 1.0); };
  const double half_width = 0.5 * camera.width_px;
  const double edge = half_width / camera.fx;
  Causes causes;
  causes.rotation = Vector3d(share() / camera.fy, share() / camera.fx, share() / half_width);
  causes.principal_point_px = Vector2d(share(), share());
  causes.k1 = share() / (camera.fx * edge * edge * edge);
  return causes;
}

/// Causes whose largest displacement is error.max_displacement_px.
[[nodiscard]] Causes causes_of(const PinholeCamera& camera, const RectificationError& error) {
  constexpr int kRounds = 3;  // the displacement is nearly proportional to the causes
  if (!(error.max_displacement_px > 0.0)) return {};
  Causes causes = drawn(camera, error.seed);
  for (int round = 0; round < kRounds; ++round) {
    causes = causes.scaled(error.max_displacement_px / largest_displacement_px(camera, causes));
  }
  return causes;
}

}  // namespace

StereoRig misrectified_rig(const PinholeCamera& camera, double baseline_m, const RectificationError& error) {
  const Causes causes = causes_of(camera, error);
  const auto lens = [&](const Vector2d& offset_px, double k1) {
    return Lens{.width_px = camera.width_px,
                .height_px = camera.height_px,
                .fx = camera.fx,
                .fy = camera.fy,
                .cx = camera.cx + offset_px.x(),
                .cy = camera.cy + offset_px.y(),
                .distortion = Distortion::kRadTan,
                .coefficients = {k1, 0.0, 0.0, 0.0}};
  };
  StereoRig rig;
  rig.left = lens(Vector2d::Zero(), 0.0);
  rig.right = lens(causes.principal_point_px, causes.k1);
  rig.T_right_left.linear() = rotation_matrix(causes.rotation);
  rig.T_right_left.translation() = rig.T_right_left.linear() * Vector3d(-baseline_m, 0.0, 0.0);
  return rig;
}

void validate(const LensError& error, const PinholeCamera& camera) {
  constexpr double kLargest = 1.0;
  constexpr double kLeastSlope = 0.2;  // image that shows a fifth of the resolution, or less, is not rendered
  constexpr int kSteps = 200;
  const double right = std::max(camera.cx, camera.width_px - 1.0 - camera.cx) / camera.fx;
  const double below = std::max(camera.cy, camera.height_px - 1.0 - camera.cy) / camera.fy;
  const double reach = std::hypot(right, below);
  bool good = std::abs(error.k1) <= kLargest && std::abs(error.k2) <= kLargest;
  for (double r = 0.0; good; r += reach / kSteps) {
    const double r2 = r * r;
    if (r * (1.0 + error.k1 * r2 + error.k2 * r2 * r2) >= reach) break;
    good = 1.0 + 3.0 * error.k1 * r2 + 5.0 * error.k2 * r2 * r2 > kLeastSlope;
  }
  if (good) return;
  throw std::invalid_argument("a lens_error of " + std::to_string(error.k1) + ", " +
                              std::to_string(error.k2) + " folds the image, or is not from -1 to 1");
}

StereoRig with_lens_error(StereoRig rig, const LensError& error) {
  for (Lens* lens : {&rig.left, &rig.right}) {
    lens->coefficients.at(0) += error.k1;
    lens->coefficients.at(1) += error.k2;
  }
  return rig;
}

}  // namespace stereo_slam::simulator
