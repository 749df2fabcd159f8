// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/right_delay.hpp"

#include <random>
#include <string>

#include "simulator/recording/simulate.hpp"
#include "stereo_slam/dataset/stereo_check.hpp"
#include "stereo_slam/support/moved_points.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

constexpr std::size_t kDelayGap = 3;
/// Points of three pairs of frames on a camera that drives ahead and nods, with 0.1 px of noise in each row
/// that is measured. The right camera is rolled and has another scale of its rows, it nods by itself from
/// pair to pair, and both lenses have a distortion that was not calibrated.
std::vector<std::vector<MovedPoint>> delayed_points(double delay, double speed) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::normal_distribution<double> noise_px(0.0, 0.1);
  std::vector<std::vector<MovedPoint>> pairs(3);
  for (std::size_t pair = 0; pair < pairs.size(); ++pair) {
    const double nod_px = 2.0 * static_cast<double>(pair);  // a frame
    for (int k = 0; k < 300; ++k) {
      const Eigen::Vector2d first_px(1200.0 * unit(random), 360.0 * unit(random));
      const double disparity_px = 4.0 + 60.0 * unit(random);
      const double moved_px = speed * ((first_px.y() - 180.0) * disparity_px / 700.0 + nod_px);
      const Eigen::Vector2d left =
          (first_px - Eigen::Vector2d(kMovingCamera.cx, kMovingCamera.cy)) / kMovingCamera.fx;
      const Eigen::Vector2d right = left - Eigen::Vector2d(disparity_px / kMovingCamera.fx, 0.0);
      const double lenses_px =
          -0.03 * kMovingCamera.fx * left.y() * (right.squaredNorm() - left.squaredNorm());
      const double misaligned_px = 0.002 * first_px.x() - 0.003 * first_px.y() + 0.7 * nod_px + lenses_px;
      MovedPoint point{first_px, disparity_px, first_px, delay * moved_px + misaligned_px + noise_px(random)};
      point.second_px.y() += static_cast<double>(kDelayGap) * moved_px + noise_px(random);
      pairs[pair].push_back(point);
    }
  }
  return pairs;
}

/// The same on a rig that vibrates: the right camera has another rotation in each pair, px.
std::vector<std::vector<MovedPoint>> vibrating_points(double delay) {
  std::mt19937 random(9);
  std::normal_distribution<double> rotation_px(0.0, 3.0);
  auto pairs = delayed_points(delay, 1.0);
  for (auto& points : pairs) {
    const Eigen::Vector3d pitch_roll_yaw_px(rotation_px(random), rotation_px(random), rotation_px(random));
    for (auto& point : points) {
      const double x = (point.first_px.x() - point.disparity_px - kMovingCamera.cx) / kMovingCamera.fx;
      const double y = (point.first_px.y() - kMovingCamera.cy) / kMovingCamera.fy;
      point.rows_px += pitch_roll_yaw_px.dot(Eigen::Vector3d(1.0 + y * y, x, x * y));
    }
  }
  return pairs;
}

/// The same, but every tenth point is wrong.
std::vector<std::vector<MovedPoint>> with_wrong_points(std::vector<std::vector<MovedPoint>> pairs) {
  std::mt19937 random(8);
  std::uniform_real_distribution<double> error_px(-30.0, 70.0);
  for (auto& points : pairs) {
    for (std::size_t k = 0; k < points.size(); k += 10) points[k].second_px.y() += error_px(random);
  }
  return pairs;
}

/// What is found in a rendered drive of ten frames a second with right images that are late.
RecordingFindings found_if_late_by(double late_s, double pause_s = 0.0) {
  const TemporaryFolder folder;
  simulator::SimulationSettings settings;
  settings.frames = 12;
  settings.samples_per_pixel = 4;
  settings.texture_size_px = 256;
  settings.camera = {496, 150, 287.5, 287.5, 242.9, 74.1};
  settings.disturbance.sync_error_s = late_s;
  simulator::simulate(settings, folder.path());
  StereoSequence sequence = open_sequence(folder.path(), "kitti");
  sequence.frames.back().stamp_ns += std::llround(1e9 * pause_s);
  const std::vector<StereoFrame> frames{load_frame(sequence, 0), load_frame(sequence, 6)};
  return findings_of(check_stereo_agreement(frames), sequence, frames);
}

std::string text_of_late_by(double late_s) {
  std::string text;
  for (const auto& problem : found_if_late_by(late_s).problems) text += problem.text;
  return text;
}

}  // namespace

TEST_CASE("Rows show a delay of the right images beside any misalignment", "[motion]") {
  for (const double frames : {-0.5, -0.2, 0.0, 0.2, 0.3, 0.5}) {
    CAPTURE(frames);
    const auto delay = right_delay(kMovingCamera, delayed_points(frames, 1.0), kDelayGap);
    REQUIRE(delay);
    CAPTURE(delay->frames, delay->sigma, delay->rows_px, delay->rest_px);
    // The noise of the motion, .1 / 3 px, pulls it to zero by less than a thousandth of itself.
    CHECK(std::abs(delay->frames - frames) < 4.0 * delay->sigma + 1e-3);
    CHECK(delay->is_clear() == (frames != 0.0));
    // A tenth of wrong points, whose weights are bounded, pulls by at most about a tenth.
    const auto pulled = right_delay(kMovingCamera, with_wrong_points(delayed_points(frames, 1.0)), kDelayGap);
    REQUIRE(pulled);
    CHECK(std::abs(pulled->frames - delay->frames) < 0.1 * std::abs(frames) + 4.0 * delay->sigma);
    CHECK(pulled->is_clear() == (frames != 0.0));
  }
}

TEST_CASE("A rig that vibrates shows its delay, and none if it has none", "[motion]") {
  const auto none = right_delay(kMovingCamera, vibrating_points(0.0), kDelayGap);
  REQUIRE(none);
  CHECK(std::abs(none->frames) < 4.0 * none->sigma);
  CHECK_FALSE(none->is_likely());
  const auto late = right_delay(kMovingCamera, vibrating_points(0.3), kDelayGap);
  REQUIRE(late);
  CHECK(std::abs(late->frames - 0.3) < 4.0 * late->sigma + 1e-3);
  CHECK(late->is_clear());
}

TEST_CASE("A delay of one pair is not one that all have", "[motion]") {
  const auto all_late = delayed_points(0.1, 1.0);
  const auto shared = right_delay(kMovingCamera, all_late, kDelayGap);
  REQUIRE(shared);
  CHECK(all_pairs_share(*shared, kMovingCamera, all_late, kDelayGap));
  auto one_late = delayed_points(0.0, 1.0);
  one_late[1] = delayed_points(1.0, 1.0)[1];
  CHECK_FALSE(all_pairs_share({.frames = 0.03}, kMovingCamera, one_late, kDelayGap));
}

TEST_CASE("A delay that is not clear is looked for in neighbouring frames", "[motion]") {
  const RightDelay vague{.frames = 0.025, .sigma = 0.004, .rows_px = 0.04};
  CHECK(vague.is_possible());
  CHECK_FALSE(vague.is_likely());
  CHECK_FALSE(RightDelay{.frames = 0.025, .sigma = 0.006, .rows_px = 0.04}.is_possible());
  CHECK_FALSE(RightDelay{.frames = 0.015, .sigma = 0.001, .rows_px = 0.04}.is_possible());
  CHECK_FALSE(RightDelay{.frames = 0.025, .sigma = 0.004, .rows_px = 0.01}.is_possible());
}

TEST_CASE("A camera that stands, and few points, show no delay", "[motion]") {
  const auto standing = right_delay(kMovingCamera, delayed_points(0.5, 0.0), kDelayGap);
  CHECK((standing && !standing->is_clear()));
  const auto slow = right_delay(kMovingCamera, delayed_points(0.5, 0.01), kDelayGap);
  CHECK((slow && !slow->is_clear()));
  CHECK_FALSE(right_delay(kMovingCamera, {}, kDelayGap));
  auto few = delayed_points(0.5, 1.0);
  for (auto& points : few) points.resize(30);
  CHECK_FALSE(right_delay(kMovingCamera, few, kDelayGap));
  StereoCamera no_camera = kMovingCamera;
  no_camera.fx = 0.0;
  CHECK_FALSE(right_delay(no_camera, delayed_points(0.5, 1.0), kDelayGap));
  CHECK(right_delay(kMovingCamera, {{}, delayed_points(0.5, 1.0)[0], {}}, kDelayGap));
}

TEST_CASE("Right images that are late or early by a part of a frame are noticed", "[motion]") {
  CHECK(text_of_late_by(0.0).empty());
  CHECK_THAT(text_of_late_by(0.05), Catch::Contains("of the time between two frames later than"));
  CHECK_THAT(text_of_late_by(-0.05), Catch::Contains("of the time between two frames earlier than"));
}

TEST_CASE("A run begins with the delay in seconds, which a pause of the recording does not change",
          "[motion]") {
  CHECK_FALSE(found_if_late_by(0.0).right_delay);
  for (const double pause_s : {0.0, 600.0}) {
    const auto delay = found_if_late_by(0.02, pause_s).right_delay;
    REQUIRE(delay);
    CHECK(std::abs(delay->seconds - 0.02) < 3.0 * delay->sigma_s);
    CHECK(delay->sigma_s < 0.004);
  }
}
