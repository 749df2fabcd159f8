// SPDX-License-Identifier: MIT
#pragma once

#include <random>

#include <opencv2/core.hpp>

#include "box_model.hpp"

namespace object_pose {

struct StereoImages {
  cv::Mat1b left, right;
};

struct Scene {
  BoxModel box;
  StereoCamera camera;
  Pose T_camera_object;
  StereoImages images;
};

struct SceneSettings {
  StereoCamera camera{.fx = 1100.0,
                      .fy = 1100.0,
                      .cx = 511.5,
                      .cy = 383.5,
                      .baseline_m = 0.16,
                      .width_px = 1024,
                      .height_px = 768};
  double min_distance_m = 0.6;
  double max_distance_m = 1.5;
  double noise_grey_levels = 2.0;
};

/// A pose in front of both cameras: any orientation, any distance within the limits.
[[nodiscard]] Pose random_pose(const SceneSettings& settings, std::mt19937_64& rng);

/// A box before a wall as both cameras see it: a homography per face, light from above the left camera, and
/// the noise of two sensors.
[[nodiscard]] StereoImages render_stereo(const BoxModel& box, const Pose& T_camera_object,
                                         const SceneSettings& settings, std::mt19937_64& rng);

/// A cube of 20 cm at a random pose.
[[nodiscard]] Scene render_scene(const SceneSettings& settings, std::uint64_t seed);

}  // namespace object_pose
