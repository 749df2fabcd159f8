// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/camera_from_motion.hpp"

#include <random>

#include <Eigen/Geometry>

#include "stereo_slam/dataset/stereo_check.hpp"
#include "stereo_slam/support/moved_points.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

/// Points as a camera sees them that moves by T_second_first (in baselines), with 0.1 px of noise. Every
/// tenth one is wrong.
std::vector<MovedPoint> seen_points(const Eigen::Isometry3d& T_second_first, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::normal_distribution<double> noise_px(0.0, 0.1);
  std::vector<MovedPoint> points;
  for (int k = 0; k < 200; ++k) {
    const Eigen::Vector2d first_px(1200.0 * unit(random), 360.0 * unit(random));
    const double disparity_px = 4.0 + 60.0 * unit(random);
    Eigen::Vector3d p;
    p << (first_px - Eigen::Vector2d(kMovingCamera.cx, kMovingCamera.cy)) / disparity_px,
        kMovingCamera.fx / disparity_px;
    const Eigen::Vector3d q = T_second_first * p;
    Eigen::Vector2d second_px =
        kMovingCamera.fx * q.head<2>() / q.z() + Eigen::Vector2d(kMovingCamera.cx, kMovingCamera.cy);
    if (k % 10 == 0) second_px += Eigen::Vector2d(80.0 * unit(random), -50.0);
    const auto noisy = [&](const Eigen::Vector2d& at) {
      return Eigen::Vector2d(at.x() + noise_px(random), at.y() + noise_px(random));
    };
    points.push_back({noisy(first_px), disparity_px + noise_px(random), noisy(second_px)});
  }
  return points;
}

std::vector<std::vector<MovedPoint>> motions(double turn_rad) {
  std::vector<std::vector<MovedPoint>> pairs;
  for (const unsigned seed : {1U, 2U, 3U}) {
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.linear() = Eigen::AngleAxisd(turn_rad, Eigen::Vector3d::UnitY()).toRotationMatrix();
    T.translation() = Eigen::Vector3d(0.05, 0.0, -1.5);
    pairs.push_back(seen_points(T, seed));
  }
  return pairs;
}

StereoCamera with_focal_length(double factor) {
  StereoCamera camera = kMovingCamera;
  camera.fx *= factor;
  camera.fy *= factor;
  return camera;
}

}  // namespace

TEST_CASE("A camera that turns shows its focal length, whatever the calibration says", "[motion]") {
  const auto pairs = motions(0.05);
  for (const double factor : {0.667, 0.889, 1.0, 1.09, 1.5}) {
    CAPTURE(factor);
    const auto camera = camera_from_motion(with_focal_length(factor), pairs);
    REQUIRE(camera);
    CAPTURE(camera->focal_factor, camera->sigma, camera->gain);
    CHECK(std::abs(std::log(camera->focal_factor * factor)) < 4.0 * camera->sigma + 0.001);
    CHECK(camera->contradicts_calibration() == (factor != 1.0));
  }
}

TEST_CASE("A camera that one pair of frames alone shows contradicts no calibration", "[motion]") {
  auto pairs = motions(0.01);
  const Eigen::Vector2d centre_px(kMovingCamera.cx, kMovingCamera.cy);
  pairs.push_back(motions(0.1)[0]);
  for (auto& point : pairs.back()) {  // as of a camera with 1.4 times the focal length
    for (auto* px : {&point.first_px, &point.second_px}) *px = centre_px + 1.4 * (*px - centre_px);
    point.disparity_px *= 1.4;
  }
  const auto camera = camera_from_motion(kMovingCamera, pairs);
  REQUIRE(camera);
  CAPTURE(camera->focal_factor, camera->spread, camera->gain);
  CHECK(camera->is_surprising());
  CHECK_FALSE(camera->contradicts_calibration());
  const auto other = camera_from_motion(with_focal_length(0.8), motions(0.05));
  REQUIRE(other);
  CHECK(other->spread > 0.0);
  CHECK(other->spread < 0.01);  // three pairs of one motion, each with a sigma of .001
  CHECK(other->contradicts_calibration());
}

TEST_CASE("Straight motion, standing still and few points contradict no calibration", "[motion]") {
  for (const double factor : {0.667, 1.0, 1.5}) {
    const auto straight = camera_from_motion(with_focal_length(factor), motions(0.0));
    CHECK((straight && !straight->contradicts_calibration()));
    const auto still =
        camera_from_motion(with_focal_length(factor), {seen_points(Eigen::Isometry3d::Identity(), 4)});
    CHECK((still && !still->contradicts_calibration()));
  }
  CHECK_FALSE(camera_from_motion(kMovingCamera, {}));
  auto few = motions(0.05);
  for (auto& points : few) points.resize(30);
  CHECK_FALSE(camera_from_motion(kMovingCamera, few));
  CHECK(camera_from_motion(kMovingCamera, {{}, motions(0.05)[0], {}}));
}

TEST_CASE("A nearly straight drive contradicts no calibration, whatever its principal point",
          "[motion][data]") {
  const auto data = data_folder();
  if (!data) return;
  for (const std::size_t frames : {12U, 20U, 30U, 51U}) {
    CAPTURE(frames);
    StereoSequence sequence = open_sequence(*data / "kitti/06_0000-0050", "kitti");
    sequence.frames.resize(frames);
    const std::vector<StereoFrame> compared{load_frame(sequence, 0), load_frame(sequence, frames / 2)};
    CHECK(problems_of(check_stereo_agreement(compared), sequence, compared).empty());
  }
}

TEST_CASE("A drive with turns contradicts a wrong focal length, and not the right one", "[motion][data]") {
  const auto data = data_folder();
  if (!data) return;
  const auto text_of_problems = [&](double factor) {
    StereoSequence sequence = open_sequence(*data / "kitti/00_0000-0200", "kitti");
    sequence.camera.fx *= factor;
    sequence.camera.fy *= factor;
    const std::vector<StereoFrame> frames{load_frame(sequence, 0), load_frame(sequence, 100)};
    std::string text;
    for (const auto& problem : problems_of(check_stereo_agreement(frames), sequence, frames))
      text += problem.text;
    return text;
  };
  CHECK(text_of_problems(1.0).empty());
  CHECK_THAT(text_of_problems(0.8), Catch::Contains("lengths ahead are 18 % too short"));
  CHECK_THAT(text_of_problems(1.09), Catch::Contains("as with a focal length of 7"));
}
