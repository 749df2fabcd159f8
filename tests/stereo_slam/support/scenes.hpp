// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include <opencv2/core.hpp>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/frontend/stereo_points.hpp"
#include "stereo_slam/local_map/landmark.hpp"
#include "stereo_slam/rig/pair_geometry.hpp"

/// Points, poses and images with known ground truth, for the tests of the SLAM's stages.
namespace stereo_slam::test {

/// A KITTI-like camera.
inline StereoCamera kitti_camera() { return {718.856, 718.856, 607.1928, 185.2157, 0.5371657, 1241, 376}; }

/// Coefficients of a rectification error that is as large as those of public recordings.
inline PairGeometry::Coefficients planted_rectification() {
  PairGeometry::Coefficients c;
  c << 0.2, -0.3, 0.1, 0.8, 0.0, -0.1, -0.4, 0.1, 0.2, 0.0,  //
      -0.2, 0.2, 0.1, -0.1, 1.4, 0.1, 0.1, -0.3, 0.1, 0.2;
  return c;
}

/// Measurement of a random point in view at depths from `near_m` to `far_m`.
inline StereoPoint random_measurement(std::mt19937_64& random, const StereoCamera& camera, double near_m,
                                      double far_m) {
  std::uniform_real_distribution<double> u(60.0, camera.width_px - 60.0);
  std::uniform_real_distribution<double> v(20.0, camera.height_px - 20.0);
  std::uniform_real_distribution<double> depth(near_m, far_m);
  return {u(random), v(random), camera.fx * camera.baseline_m / depth(random)};
}

/// Independent errors of `sigma_px` in u_left, u_right and v.
inline Vector3<double> stereo_noise(std::mt19937_64& random, double sigma_px) {
  std::normal_distribution<double> normal(0.0, sigma_px);
  const double left = normal(random);
  const double right = normal(random);
  return {left, normal(random), left - right};
}

/// A motion like a car's: forward, with a little of everything else.
inline Pose car_motion(double forward_m = 0.9) {
  Vector6<double> xi;
  xi << 0.004, 0.02, -0.002, 0.02, -0.015, forward_m;
  return Pose::exp(xi);
}

/// Points with these measurements and empty descriptors.
inline StereoPoints points_at(const std::vector<StereoPoint>& measurements) {
  StereoPoints points;
  for (const auto& z : measurements) points.measured.push_back({z, z.head<2>()});
  points.descriptors.resize(measurements.size());
  return points;
}

/// Landmark in the reference frame with the covariance of one triangulation.
inline Landmark landmark_at(const StereoPoint& z, double sigma_px) {
  Landmark landmark;
  landmark.mean = z;
  landmark.covariance = stereo_pixel_covariance(sigma_px);
  landmark.anchor_px = landmark.last_px = z.head<2>();
  return landmark;
}

/// Band-limited image without symmetry, defined at every real position: values in about 0..255.
inline double smooth_texture(double x, double y) {
  return 127.0 + 25.0 * std::sin(0.31 * x + 0.12 * y) + 22.0 * std::sin(0.17 * x - 0.29 * y + 1.0) +
         18.0 * std::sin(0.41 * y + 0.05 * x + 2.0) + 16.0 * std::cos(0.23 * x + 0.37 * y) +
         14.0 * std::sin(0.83 * x + 0.41 * y) + 14.0 * std::cos(0.52 * x - 0.77 * y);
}

/// The texture with its origin moved by `shift`, times gain plus offset.
inline cv::Mat texture_image(cv::Size size, cv::Point2d shift, double gain = 1.0, double offset = 0.0) {
  cv::Mat image(size, CV_8UC1);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      image.at<std::uint8_t>(y, x) =
          cv::saturate_cast<std::uint8_t>(gain * smooth_texture(x - shift.x, y - shift.y) + offset);
    }
  }
  return image;
}

/// A chessboard with squares of `side` pixels, moved to the left by `shift` pixels, with Gaussian noise.
inline cv::Mat chessboard(cv::Size size, int side, double shift, double noise = 2.0) {
  constexpr int kFine = 4;  // places a pixel, which its brightness is the mean of
  cv::Mat image(size, CV_8UC1);
  cv::RNG random(1);
  const auto colour = [side](double x, double y) {
    return static_cast<int>(std::floor(x / side) + std::floor(y / side)) % 2;
  };
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      double white = 0.0;
      for (int i = 0; i < kFine; ++i) white += colour(x + shift + (i + 0.5) / kFine, y) / double{kFine};
      image.at<std::uint8_t>(y, x) =
          cv::saturate_cast<std::uint8_t>(40.0 + 170.0 * white + random.gaussian(noise));
    }
  }
  return image;
}

}  // namespace stereo_slam::test
