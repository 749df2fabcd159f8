// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <random>
#include <vector>

#include "stereo_slam/core/pose_estimate.hpp"
#include "stereo_slam/local_map/landmark.hpp"
#include "stereo_slam/local_map/match.hpp"
#include "stereo_slam/support/scenes.hpp"

namespace stereo_slam::test {

inline constexpr double kSceneSigma_px = 0.5;  ///< of the measurements, and of the landmarks

/// Landmarks of a keyframe re-observed from `truth`, and the prior of that pose.
struct MatchedScene {
  StereoCamera camera = kitti_camera();
  std::vector<Landmark> landmarks;
  std::vector<Match> matches;
  PoseGaussian prior{Pose::identity(), Matrix6<double>::Identity() * 1e-6};

  MapView map() const { return {landmarks, camera}; }
};

/// `count` landmarks in view; the prior's error has the given standard deviations.
inline MatchedScene make_scene(std::mt19937_64& random, const Pose& truth, int count,
                               double rotation_sigma_rad, double translation_sigma_m) {
  MatchedScene scene;
  const StereoCamera& camera = scene.camera;
  std::normal_distribution<double> normal;
  Vector6<double> sigma;
  sigma << Vector3<double>::Constant(rotation_sigma_rad), Vector3<double>::Constant(translation_sigma_m);
  Vector6<double> error;
  for (double& e : error) e = normal(random);
  scene.prior = {truth.boxplus(sigma.cwiseProduct(error)), sigma.cwiseAbs2().asDiagonal()};
  while (static_cast<int>(scene.matches.size()) < count) {
    const StereoPoint z = random_measurement(random, camera, 5.0, 45.0);
    const auto seen = camera.project(truth.inverse() * camera.back_project(z));
    if (!seen || !camera.in_view(*seen)) continue;
    const StereoPoint measured = *seen + stereo_noise(random, kSceneSigma_px);
    const std::vector<Landmark> landmark{
        landmark_at(z + stereo_noise(random, kSceneSigma_px), kSceneSigma_px)};
    const auto predicted = project_landmarks({landmark, camera}, scene.prior, 1e3);
    if (predicted.empty()) continue;  // out of view at the prior's pose
    scene.matches.push_back({scene.landmarks.size(), measured, measured.head<2>(),
                             stereo_pixel_covariance(kSceneSigma_px), predicted.front()});
    scene.landmarks.push_back(landmark.front());
  }
  return scene;
}

}  // namespace stereo_slam::test
