// SPDX-License-Identifier: MIT
// A camera that looks down from a drone: the ground is six hundred baselines away, so that its disparity is
// less than a pixel and hardly larger than its noise.
#include <cmath>
#include <vector>

#include <Eigen/Cholesky>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "stereo_slam/slam/slam.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

constexpr int kFlightFrames = 40;
constexpr double kHeight_m = 60.0;
constexpr double kStep_m = 1.0;
const StereoCamera kDownward{450.0, 450.0, 187.5, 119.5, 0.1, 376, 240};

/// Ground with details of all sizes, one pixel of it as wide as .6 pixels of the images.
cv::Mat1f ground() {
  constexpr int kSide = 1024;
  cv::RNG random(3);
  cv::Mat1f texture(kSide, kSide, 0.0F);
  double amplitude = 6.0;
  for (int side = 16; side <= kSide; side *= 2, amplitude *= 1.3) {
    cv::Mat1f noise(side, side);
    random.fill(noise, cv::RNG::NORMAL, 0.0, amplitude);
    cv::Mat1f enlarged;
    cv::resize(noise, enlarged, texture.size(), 0, 0, cv::INTER_CUBIC);
    texture += enlarged;
  }
  texture += cv::Scalar(128.0);
  return texture;
}

/// The image of a camera above the ground at (x, y) metres, without rotation: y is backwards in the image.
cv::Mat1b image_at(const cv::Mat1f& texture, double x_m, double y_m, cv::RNG& random, double noise) {
  constexpr int kSamples = 2;  // per pixel and axis
  const double pixels_per_m = kDownward.fx / kHeight_m / 0.6;
  cv::Mat1f column(kDownward.height_px * kSamples, kDownward.width_px * kSamples), row(column.size());
  for (int i = 0; i < column.rows; ++i) {
    for (int j = 0; j < column.cols; ++j) {
      const double u = (j + 0.5) / kSamples - 0.5 - kDownward.cx;
      const double v = (i + 0.5) / kSamples - 0.5 - kDownward.cy;
      const double side = texture.cols;
      column(i, j) = static_cast<float>(
          std::fmod((x_m + kHeight_m * u / kDownward.fx) * pixels_per_m + 10.0 * side, side));
      row(i, j) = static_cast<float>(
          std::fmod((y_m + kHeight_m * v / kDownward.fy) * pixels_per_m + 10.0 * side, side));
    }
  }
  cv::Mat1f fine, image, grain(kDownward.height_px, kDownward.width_px);
  cv::remap(texture, fine, column, row, cv::INTER_CUBIC, cv::BORDER_WRAP);
  cv::resize(fine, image, grain.size(), 0, 0, cv::INTER_AREA);
  random.fill(grain, cv::RNG::NORMAL, 0.0, noise);
  cv::Mat1b result;
  image += grain;
  image.convertTo(result, CV_8U);
  return result;
}

/// The results of a flight ahead, upwards in the images.
std::vector<FrameResult> fly(double noise) {
  const cv::Mat1f texture = ground();
  cv::RNG random(5);
  Slam slam(kDownward, {});
  std::vector<FrameResult> results;
  for (int i = 0; i < kFlightFrames; ++i) {
    StereoFrame frame;
    frame.index = static_cast<std::size_t>(i);
    frame.stamp_ns = 100'000'000LL * i;
    frame.left = image_at(texture, 0.0, -kStep_m * i, random, noise);
    frame.right = image_at(texture, kDownward.baseline_m, -kStep_m * i, random, noise);
    results.push_back(slam.process(frame));
  }
  return results;
}

TEST_CASE("Over ground whose disparity is hardly larger than its noise, the path is not too short",
          "[stereo_slam][slam]") {
  for (const double noise : {2.0, 6.0}) {
    CAPTURE(noise);
    const auto results = fly(noise);
    const FrameResult& last = results.back();
    REQUIRE(last.status != TrackingStatus::kLost);
    const double path_m = kStep_m * (kFlightFrames - 1);
    const double share = last.T_world_camera.pose.translation().norm() / path_m;
    CAPTURE(share, last.calibration.scale_sigma);
    CHECK(std::abs(share - 1.0) < 0.03);
    // The allowance for a common error of all disparities, .03 px, of .75 px.
    CHECK(last.calibration.scale_sigma > 0.03);
    CHECK(last.calibration.scale_sigma < 0.06);
    Vector6<double> flown = Vector6<double>::Zero();
    flown[4] = -path_m;
    const Vector6<double> error = last.T_world_camera.pose.boxminus(Pose::exp(flown));
    constexpr double kChi2_6_95 = 12.59;
    CHECK(error.dot(last.T_world_camera.covariance.ldlt().solve(error)) < kChi2_6_95);
  }
}

}  // namespace
}  // namespace stereo_slam
