// SPDX-License-Identifier: MIT
#include "stereo_slam/inertial/inertial_filter.hpp"

#include <algorithm>
#include <limits>
#include <vector>

#include <Eigen/Cholesky>

#include "stereo_slam/support/inertial_tracker.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

TEST_CASE("Velocity, gravity and biases are found in motion within a second or two", "[inertial]") {
  Tracker tracker(Flight{}, 3);
  tracker.run(40);
  REQUIRE(phase(tracker) == InertialPhase::kRunning);
  CHECK(tracker.error().head<3>().norm() < 0.1);                  // m/s
  CHECK(tracker.error().segment<3>(3).norm() / kGravity < 0.03);  // rad
  tracker.run(400);
  CHECK(tracker.error().head<3>().norm() < 0.05);
  CHECK(tracker.error().segment<3>(3).norm() / kGravity < 0.01);
  CHECK(tracker.error().segment<3>(6).norm() < 2e-3);
  CHECK(tracker.filter().summary().starts == 1);
  CHECK(tracker.filter().summary().restarts == 0);
}

TEST_CASE("They are found at rest, too", "[inertial]") {
  Tracker tracker(Flight{.shake = 0.0, .travel = 0.0}, 5);
  tracker.run(60);
  REQUIRE(phase(tracker) == InertialPhase::kRunning);
  CHECK(tracker.error().head<3>().norm() < 0.05);
  CHECK(tracker.error().segment<3>(3).norm() / kGravity < 0.05);  // the bias of the accelerometer tilts it
}

TEST_CASE("The covariance is as large as the error", "[inertial]") {
  constexpr int kFlights = 60;
  double velocity = 0.0, gyroscope = 0.0, accelerometer = 0.0;
  for (int seed = 0; seed < kFlights; ++seed) {
    Tracker tracker(Flight{}, static_cast<std::uint64_t>(100 + seed));
    tracker.run(200);
    REQUIRE(phase(tracker) == InertialPhase::kRunning);
    velocity += nees(tracker, 0) / kFlights;
    gyroscope += nees(tracker, 6) / kFlights;
    accelerometer += nees(tracker, 9) / kFlights;
  }
  // Means of 60 chi-squares of three degrees of freedom: 3 +- 3.3 * sqrt(6 / 60). The filter doubles the
  // noise of the IMU, as it is no white noise in real motion, and so errors may be smaller.
  constexpr double kMost = 3.0 + 1.04;
  CHECK(velocity < kMost);
  CHECK(velocity > 0.5);
  CHECK(gyroscope < kMost);
  CHECK(accelerometer < kMost);
}

TEST_CASE("An error that the motions of all images have in common does not pass for a bias", "[inertial]") {
  constexpr int kFlights = 60;
  constexpr double kShare = 0.1;  // of the noise of a motion, as ImageDrift has it
  double velocity = 0.0, gyroscope = 0.0, accelerometer = 0.0, largest_rad_s = 0.0;
  for (int seed = 0; seed < kFlights; ++seed) {
    Tracker tracker(Flight{}, static_cast<std::uint64_t>(300 + seed));
    std::mt19937_64 random(static_cast<std::uint64_t>(seed));
    tracker.drift << normal3(random, kShare * kOdometry_rad), normal3(random, kShare * kOdometry_m);
    tracker.run(200);
    REQUIRE(phase(tracker) == InertialPhase::kRunning);
    velocity += nees(tracker, 0) / kFlights;
    gyroscope += nees(tracker, 6) / kFlights;
    accelerometer += nees(tracker, 9) / kFlights;
    largest_rad_s = std::max(largest_rad_s, tracker.error().segment<3>(6).norm());
  }
  constexpr double kMost = 3.0 + 1.04;  // as without such errors
  CHECK(velocity < kMost);
  CHECK(gyroscope < kMost);
  CHECK(accelerometer < kMost);
  CHECK(largest_rad_s > kShare * kOdometry_rad / (1e-9 * kFrame_ns));  // the error is there
}

TEST_CASE("The tilt of the path over keyframes stays within its covariance, which stays bounded",
          "[inertial][tilt]") {
  constexpr int kFlights = 30;
  double nees = 0.0, early_rad = 0.0, late_rad = 0.0, of_images_rad = 0.0;
  for (int seed = 0; seed < kFlights; ++seed) {
    Tracker tracker(Flight{}, static_cast<std::uint64_t>(500 + seed));
    tracker.run(400);
    const auto sigma = [&](const LinkedPose& path) {
      return std::sqrt(tracker.tilt_error(path).covariance.trace());
    };
    early_rad += sigma(tracker.path()) / kFlights;
    tracker.run(1600);
    late_rad += sigma(tracker.path()) / kFlights;
    of_images_rad += sigma(tracker.path_of_images()) / kFlights;
    const auto [e, P] = tracker.tilt_error(tracker.path());
    nees += e.dot(P.ldlt().solve(e)) / kFlights;
  }
  CAPTURE(nees, early_rad, late_rad, of_images_rad);
  CHECK(late_rad < 1.1 * early_rad);  // the path of the images has twice as much after four times the way
  CHECK(late_rad < 0.5 * of_images_rad);
  CHECK(nees < 2.0 + 3.3 * 2.0 / std::sqrt(kFlights));  // less: the filter doubles the noise of the IMU
  CHECK(nees > 0.2);
}

TEST_CASE("A second without images is bridged to two centimetres", "[inertial]") {
  Tracker tracker(Flight{}, 7);
  tracker.sees = [](int frame) { return frame < 300 || frame >= 320; };
  tracker.run(320);
  CHECK(tracker.prior_error().tail<3>().norm() < 0.02);
  tracker.run(330);
  CHECK(phase(tracker) == InertialPhase::kRunning);
  CHECK(tracker.filter().summary().starts == 1);
}

TEST_CASE("Missing samples cost the velocity until it is found again, and nothing else", "[inertial]") {
  Tracker tracker(Flight{}, 9);
  tracker.reads = [](int frame) { return frame < 200 || frame >= 204; };
  tracker.run(205);
  CHECK(phase(tracker) == InertialPhase::kStarting);
  tracker.run(260);
  CHECK(phase(tracker) == InertialPhase::kRunning);
  CHECK(tracker.filter().summary().starts == 2);
  CHECK(tracker.filter().summary().restarts == 0);
  CHECK(tracker.error().head<3>().norm() < 0.1);
}

TEST_CASE("Readings that contradict the images are switched off, and their fault is named", "[inertial]") {
  struct Case {
    std::string fault;
    std::function<void(ImuSample&)> distort;
  };
  const Matrix3<double> quarter = (Matrix3<double>() << 0, -1, 0, 1, 0, 0, 0, 0, 1).finished();
  const Flight flight;
  const std::vector<Case> cases = {
      {"in degrees", [](ImuSample& s) { s.angular_velocity *= 57.29578; }},
      {"in multiples of gravity", [](ImuSample& s) { s.specific_force /= 9.80665; }},
      {"turned by 90 degrees",
       [&](ImuSample& s) {
         s.angular_velocity = quarter * s.angular_velocity;
         s.specific_force = quarter * s.specific_force;
       }},
      {"turned by 180 degrees",
       [&](ImuSample& s) {
         s.angular_velocity = quarter * quarter * s.angular_velocity;
         s.specific_force = quarter * quarter * s.specific_force;
       }},
  };
  for (const auto& [fault, distort] : cases) {
    Tracker tracker(flight, 11);
    tracker.distort = distort;
    tracker.run(400);
    INFO(fault << ": " << tracker.filter().summary().fault);
    CHECK(phase(tracker) == InertialPhase::kOff);
    CHECK(tracker.filter().summary().fault.find(fault) != std::string::npos);
    CHECK_FALSE(tracker.filter().predicted());
  }
}

TEST_CASE("Axes that are turned by some degrees are found, and cost nothing", "[inertial]") {
  constexpr double kDegree = 0.0174533;
  for (const double degrees : {0.0, 2.0, 10.0}) {
    for (int axis = 0; axis < 3; ++axis) {
      CAPTURE(degrees, axis);
      const Vector3<double> turn = degrees * kDegree * Vector3<double>::Unit(axis);
      Vector6<double> xi = Vector6<double>::Zero();
      xi.head<3>() = turn;
      const Matrix3<double> R = Pose::exp(xi).rotation_matrix();
      Tracker tracker(Flight{}, static_cast<std::uint64_t>(21 + axis));
      tracker.distort = [&](ImuSample& sample) {  // the sensor reads in axes that are turned
        sample.angular_velocity = (R.transpose() * sample.angular_velocity).eval();
        sample.specific_force = (R.transpose() * sample.specific_force).eval();
      };
      tracker.run(300);
      const InertialSummary& summary = tracker.filter().summary();
      CHECK(summary.phase == InertialPhase::kRunning);
      CHECK(summary.restarts == 0);
      // Three numbers: 4 sigma. Fifteen seconds tell them to a quarter of a degree.
      CHECK(((summary.turn_rad - turn).cwiseAbs() - 4.0 * summary.turn_sigma_rad).maxCoeff() < 0.0);
      CHECK(summary.turn_sigma_rad.maxCoeff() < 0.25 * kDegree);
      CHECK(tracker.error().head<3>().norm() < 0.05);
    }
  }
}

TEST_CASE("An IMU that is some centimetres off its place is found by its turns", "[inertial]") {
  const Flight flight;
  for (int axis = 0; axis < 3; ++axis) {
    CAPTURE(axis);
    const Vector3<double> offset = 0.03 * Vector3<double>::Unit(axis);
    Tracker tracker(flight, static_cast<std::uint64_t>(41 + axis));
    tracker.distort = [&](ImuSample& sample) {
      sample.specific_force += flight.reading(sample.stamp_ns, offset).specific_force -
                               flight.reading(sample.stamp_ns).specific_force;
    };
    tracker.run(600);
    const InertialSummary& summary = tracker.filter().summary();
    CHECK(summary.restarts == 0);
    CHECK(((summary.offset_m - offset).cwiseAbs() - 4.0 * summary.offset_sigma_m).maxCoeff() < 0.0);
    CHECK(summary.offset_sigma_m.maxCoeff() < 0.01);  // half of the prior's
    CHECK(tracker.error().head<3>().norm() < 0.05);
  }
}

TEST_CASE("A motion that is not the camera's is not used where landmarks agree with the IMU", "[inertial]") {
  Tracker tracker(Flight{}, 13);
  tracker.follows_vehicle = [](int frame) { return frame >= 200 && frame < 220; };
  tracker.run(220);
  CHECK(tracker.contradictions() == 20);
  CHECK(phase(tracker) == InertialPhase::kRunning);
  CHECK(tracker.filter().summary().restarts == 0);
  CHECK(tracker.error().head<3>().norm() < 0.05);
}

TEST_CASE("Bad samples do not reach the state", "[inertial]") {
  Tracker tracker(Flight{}, 15);
  int count = 0;
  tracker.distort = [&](ImuSample& sample) {
    if (++count % 7 == 0) sample.specific_force.x() = std::numeric_limits<double>::quiet_NaN();
    if (count % 11 == 0) sample.stamp_ns -= 20'000'000;
  };
  tracker.run(200);
  CHECK(phase(tracker) == InertialPhase::kRunning);
  CHECK(tracker.error().allFinite());
  CHECK(tracker.error().head<3>().norm() < 0.2);
}

TEST_CASE("Without readings there is nothing to predict with", "[inertial]") {
  InertialFilter filter;
  filter.begin_frame(0, std::nullopt);
  filter.begin_map(0);
  filter.begin_frame(kFrame_ns, std::nullopt);
  CHECK_FALSE(filter.predicted());
  filter.end_frame({.stamp_ns = kFrame_ns, .T_keyframe_camera = {}}, std::nullopt);
  CHECK(filter.summary().phase == InertialPhase::kNone);
  CHECK(filter.estimate().phase == InertialPhase::kNone);
}

TEST_CASE("The velocity changes with the motion since the keyframe when that is measured anew",
          "[inertial]") {
  constexpr double kRounding = 1e-9;
  Tracker tracker(Flight{}, 17);
  tracker.run(205);
  REQUIRE(phase(tracker) == InertialPhase::kRunning);
  Vector6<double> change;
  change << 1e-3, -2e-3, 3e-3, 0.03, -0.02, 0.05;  // on the right: in the axes of the camera
  InertialFilter filter = tracker.filter();
  filter.remeasure(change);
  const double since_s = 1e-9 * static_cast<double>((204 % kFramesPerKeyframe) * kFrame_ns);
  const Vector3<double> expected_m_s =
      T_camera_imu().rotation_matrix().transpose() * change.tail<3>() / since_s;
  const InertialEstimate before = tracker.filter().estimate(), after = filter.estimate();
  CHECK((after.velocity - before.velocity - expected_m_s).norm() < kRounding);
  CHECK((after.gravity - before.gravity).norm() == 0.0);
  CHECK((after.biases - before.biases).norm() == 0.0);

  tracker.run(15 * kFramesPerKeyframe + 1);  // the last frame is the keyframe
  InertialFilter at_keyframe = tracker.filter();
  at_keyframe.remeasure(change);
  CHECK((at_keyframe.estimate().velocity - tracker.filter().estimate().velocity).norm() == 0.0);
}
