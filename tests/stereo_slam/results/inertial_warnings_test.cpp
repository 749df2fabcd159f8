// SPDX-License-Identifier: MIT
#include "stereo_slam/results/inertial_warnings.hpp"

#include "support/catch.hpp"

using namespace stereo_slam;

namespace {

[[nodiscard]] InertialSummary running() {
  return {.phase = InertialPhase::kRunning, .starts = 1, .nis = 5.0};
}

}  // namespace

TEST_CASE("An IMU that was used, and agrees with its calibration, gives no warning", "[results][imu]") {
  CHECK(inertial_warnings(running(), 0).empty());
  InertialSummary slightly = running();
  slightly.turn_rad << 0.03, 0.0, 0.0;
  slightly.turn_sigma_rad.setConstant(0.001);
  CHECK(inertial_warnings(slightly, 0).empty());
}

TEST_CASE("A delay is told with what is to be written into the calibration", "[results][imu]") {
  InertialSummary imu = running();
  imu.delay_s = -0.02;
  imu.delay_sigma_s = 2e-4;
  REQUIRE(inertial_warnings(imu, 0).size() == 1);
  CHECK_THAT(inertial_warnings(imu, 0)[0],
             Catch::Contains("20.0 ms earlier than those of the images, which") &&
                 Catch::Contains("set timeshift_cam_imu to -0.0200"));
  CHECK_THAT(inertial_warnings(imu, 5'000'000)[0],
             Catch::Contains("and the known delay") && Catch::Contains("timeshift_cam_imu to -0.0150"));
  imu.delay_sigma_s = 0.01;  // it may be nothing
  CHECK(inertial_warnings(imu, 0).empty());
  imu.delay_s = 0.001;
  imu.delay_sigma_s = 1e-4;  // certain, and of no consequence
  CHECK(inertial_warnings(imu, 0).empty());
}

TEST_CASE("A turn of more than two degrees is told if it is certain", "[results][imu]") {
  InertialSummary imu = running();
  imu.turn_rad << 0.0, 0.1, 0.0;
  imu.turn_sigma_rad.setConstant(0.03);
  CHECK(inertial_warnings(imu, 0).empty());
  imu.turn_sigma_rad.setConstant(0.01);
  REQUIRE(inertial_warnings(imu, 0).size() == 1);
  CHECK_THAT(inertial_warnings(imu, 0)[0], Catch::Contains("turned by 5.7 degrees against the calibration"));
}

TEST_CASE("An IMU that is three centimetres off its place is told if it is certain", "[results][imu]") {
  InertialSummary imu = running();
  imu.offset_m << 0.0, -0.04, 0.0;
  imu.offset_sigma_m.setConstant(0.015);
  CHECK(inertial_warnings(imu, 0).empty());
  imu.offset_sigma_m.setConstant(0.004);
  REQUIRE(inertial_warnings(imu, 0).size() == 1);
  CHECK_THAT(inertial_warnings(imu, 0)[0], Catch::Contains("is 0, -40, 0 mm along its axes from where"));
  imu.offset_m << 0.0, -0.02, 0.0;
  CHECK(inertial_warnings(imu, 0).empty());
}

TEST_CASE("An IMU that was switched off, or never used, is told with the cause", "[results][imu]") {
  InertialSummary off{.phase = InertialPhase::kOff, .fault = "the reason"};
  off.turn_rad << 1.0, 0.0, 0.0;  // of no use any more
  REQUIRE(inertial_warnings(off, 0).size() == 1);
  CHECK_THAT(inertial_warnings(off, 0)[0], Catch::Contains("switched off before it was used: the reason"));
  CHECK_THAT(inertial_warnings({.phase = InertialPhase::kStarting}, 0)[0],
             Catch::Contains("the IMU was not used"));
}
