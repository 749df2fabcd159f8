// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "stereo_world.hpp"

namespace consistency {

/// A point seen in one frame. Association is known.
struct Observation {
  std::size_t point = 0;
  Vector3<double> z;
};

struct DriveFrame {
  Pose T_world_camera;   ///< true
  Pose T_previous_this;  ///< odometry
  std::vector<Observation> observations;
};

/// A camera driven through a corridor of points: 1 m a frame in gentle turns, 100 tracked points 3 to 45 m
/// away, each as long as it is in view.
struct Drive {
  static constexpr double kPixelSigma = 0.5;
  static constexpr double kOdometryRotationSigma = 0.05 * M_PI / 180.0;  // rad
  static constexpr double kOdometryTranslationSigma = 0.02;              // m
  static constexpr std::size_t kTracked = 100;

  StereoCamera camera = kitti_camera();
  std::vector<DriveFrame> frames;

  [[nodiscard]] static Matrix3<double> pixel_covariance() {
    return stereo_slam::stereo_pixel_covariance(kPixelSigma);
  }
  [[nodiscard]] static Matrix6<double> odometry_covariance() {
    return isotropic_covariance(kOdometryRotationSigma, kOdometryTranslationSigma);
  }
};

[[nodiscard]] inline Drive random_drive(unsigned seed, int frames) {
  Rng rng(seed);
  Drive drive;
  const double turn_phase = uniform(rng, 0.0, 2.0 * M_PI);
  Pose truth = Pose::identity();
  std::vector<Vector3<double>> points;
  const auto scatter = [&](const Pose& T_world_camera, double depth) {
    for (int i = 0; i < 12; ++i) {
      const double side = uniform(rng, -1.0, 1.0);
      points.push_back(T_world_camera * Vector3<double>(std::copysign(1.5, side) + 12.0 * side,
                                                        uniform(rng, -5.0, 1.7), depth));
    }
  };
  for (double depth = 3.0; depth < 45.0; depth += 1.0) scatter(truth, depth);

  std::vector<std::size_t> tracked;
  for (int k = 0; k < frames; ++k) {
    DriveFrame frame;
    if (k > 0) {
      Vector6<double> twist = Vector6<double>::Zero();
      twist[1] = 0.02 * std::sin(0.05 * k + turn_phase);
      twist[5] = 1.0;
      const Pose motion = Pose::exp(twist);
      truth = (truth * motion).renormalized();
      frame.T_previous_this = motion.boxplus(draw_gaussian<6>(rng, Drive::odometry_covariance()));
      scatter(truth, 45.0);
    } else {
      frame.T_previous_this = Pose::identity();
    }
    frame.T_world_camera = truth;

    const Pose T_camera_world = truth.inverse();
    const auto seen = [&](std::size_t i) {
      const Vector3<double> p = T_camera_world * points[i];
      return p.z() > 3.0 && p.z() < 45.0 && drive.camera.in_view(drive.camera.project_unchecked(p));
    };
    std::erase_if(tracked, [&](std::size_t i) { return !seen(i); });
    std::vector<std::size_t> candidates;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (seen(i) && std::find(tracked.begin(), tracked.end(), i) == tracked.end()) candidates.push_back(i);
    }
    std::shuffle(candidates.begin(), candidates.end(), rng);
    for (std::size_t i = 0; i < candidates.size() && tracked.size() < Drive::kTracked; ++i) {
      tracked.push_back(candidates[i]);
    }
    for (const std::size_t i : tracked) {
      frame.observations.push_back({i, drive.camera.project_unchecked(T_camera_world * points[i]) +
                                           draw_gaussian<3>(rng, Drive::pixel_covariance())});
    }
    drive.frames.push_back(std::move(frame));
  }
  return drive;
}

}  // namespace consistency
