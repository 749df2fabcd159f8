// SPDX-License-Identifier: MIT
#pragma once

#include <random>

#include <opencv2/core.hpp>

#include "box_model.hpp"

namespace object_pose {

/// A rectified stereo pair of grey images.
struct StereoImages {
  cv::Mat1b left, right;
};

/// A rendered box with its ground truth.
struct Scene {
  BoxModel box;
  StereoCamera camera;
  Pose T_camera_object;
  StereoImages images;
};

/// The cameras, and where a rendered box may be.
struct SceneSettings {
  StereoCamera camera{.fx = 1100.0,
                      .fy = 1100.0,
                      .cx = 511.5,
                      .cy = 383.5,
                      .baseline_m = 0.16,
                      .width_px = 1024,
                      .height_px = 768};
  double min_distance_m = 0.6;  ///< of the centre of the box
  double max_distance_m = 1.5;
  double noise_grey_levels = 2.0;  ///< standard deviation, of 255 levels
};

/// A random T_camera_object in front of both cameras: any orientation, any distance within the limits.
[[nodiscard]] Pose random_pose(const SceneSettings& settings, std::mt19937_64& rng);

/// A box in front of a wall as both cameras see it: a homography per face, light from behind the cameras,
/// above and to the left, and independent noise in both images.
[[nodiscard]] StereoImages render_stereo(const BoxModel& box, const Pose& T_camera_object,
                                         const SceneSettings& settings, std::mt19937_64& rng);

/// A cube of 20 cm at a random pose.
[[nodiscard]] Scene render_scene(const SceneSettings& settings, std::uint64_t seed);

}  // namespace object_pose
