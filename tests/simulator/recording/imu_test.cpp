// SPDX-License-Identifier: MIT
#include "simulator/recording/imu.hpp"

#include <cmath>
#include <cstdint>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

#include <antipode/sensors/inertial_propagation.hpp>

#include "simulator/world/path_spline.hpp"
#include "simulator/world/ride.hpp"
#include "support/catch.hpp"

namespace stereo_slam::simulator {
namespace {

constexpr double kImuFps = 10.0;
const ImuSettings kNoiseFree{.gyroscope_noise = 0,
                             .accelerometer_noise = 0,
                             .gyroscope_walk = 0,
                             .accelerometer_walk = 0,
                             .gyroscope_bias = 0,
                             .accelerometer_bias = 0};

antipode::DualQuaternion<double> pose_of(const Eigen::Isometry3d& T) {
  return antipode::DualQuaternion<double>::from_isometry(T);
}

/// The readings integrated from the first frame to the last one.
antipode::ExtendedPose<double, 3> integrated(const CameraPath& path,
                                             const std::vector<ImuReading>& readings) {
  std::vector<antipode::ImuSample<double>> samples;
  samples.reserve(readings.size());
  for (const auto& reading : readings) {
    samples.push_back({std::llround(1e9 * reading.time_s), reading.angular_velocity, reading.specific_force});
  }
  antipode::ExtendedPose<double, 3> start;
  start.pose = pose_of(path.front());
  start.velocity = PathSpline(path, kImuFps).at(0.0).velocity;
  start.vectors = Eigen::Vector3d(0, ImuSettings::kGravity, 0);
  const auto end_ns = std::llround(1e9 * static_cast<double>(path.size() - 1) / kImuFps);
  const auto motion = antipode::integrate_imu(samples, {0, end_ns}, antipode::Vector6<double>::Zero(),
                                              antipode::ImuNoise<double>{});
  REQUIRE(motion.status == antipode::InertialStatus::kComplete);
  return motion(start);
}

double length_m(const CameraPath& path) {
  double sum = 0.0;
  for (std::size_t i = 1; i < path.size(); ++i)
    sum += (path[i].translation() - path[i - 1].translation()).norm();
  return sum;
}

TEST_CASE("Readings without noise lead along the path", "[imu]") {
  const CameraPath street = street_loop(101, kImuFps), highway = highway_drive(101, kImuFps);
  const CameraPath rough = on_bad_road(street, {.bounce_m = 0.01}, kImuFps, 1);
  for (const CameraPath& path : {street, highway, rough}) {
    const auto end = integrated(path, imu_readings(path, kImuFps, kNoiseFree, 1));
    const auto error = end.pose.boxminus(pose_of(path.back()));
    CAPTURE(length_m(path), error.transpose());
    CHECK(error.tail<3>().norm() <= 1e-4 * length_m(path));
    CHECK(error.head<3>().norm() <= 1e-4);
  }
}

TEST_CASE("An IMU at rest reads gravity, upwards", "[imu]") {
  const CameraPath still(11, Eigen::Isometry3d::Identity());
  const auto readings = imu_readings(still, kImuFps, kNoiseFree, 1);
  CHECK(readings.size() == 201);
  for (const auto& reading : readings) {
    CHECK(reading.angular_velocity.norm() == 0.0);
    CHECK((reading.specific_force - Eigen::Vector3d(0, -ImuSettings::kGravity, 0)).norm() <= 1e-12);
  }
}

TEST_CASE("Noise and biases have the given sizes", "[imu][random]") {
  const CameraPath still(501, Eigen::Isometry3d::Identity());  // 50 s
  ImuSettings settings = kNoiseFree;
  settings.gyroscope_noise = 1e-3;
  settings.accelerometer_noise = 2e-2;
  const auto readings = imu_readings(still, kImuFps, settings, 1);
  double w = 0.0, a = 0.0;
  for (const auto& reading : readings) {
    w += reading.angular_velocity.squaredNorm();
    a += (reading.specific_force + Eigen::Vector3d(0, ImuSettings::kGravity, 0)).squaredNorm();
  }
  const double numbers = 3.0 * static_cast<double>(readings.size());
  const double allowed = 4.0 / std::sqrt(2.0 * numbers);
  CHECK(std::sqrt(w / numbers) == Approx(1e-3 * std::sqrt(200.0)).epsilon(allowed));
  CHECK(std::sqrt(a / numbers) == Approx(2e-2 * std::sqrt(200.0)).epsilon(allowed));

  settings = kNoiseFree;
  settings.gyroscope_walk = 1e-4;
  settings.accelerometer_bias = 0.1;
  double walked = 0.0, bias = 0.0;
  constexpr int kSeeds = 50;
  const CameraPath short_path(21, Eigen::Isometry3d::Identity());  // 2 s
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    const auto drift = imu_readings(short_path, kImuFps, settings, seed);
    walked += drift.back().gyroscope_bias.squaredNorm();
    bias += drift.back().accelerometer_bias.squaredNorm();
  }
  const double few = 4.0 / std::sqrt(2.0 * 3 * kSeeds);
  CHECK(std::sqrt(walked / (3 * kSeeds)) == Approx(1e-4 * std::sqrt(2.0)).epsilon(few));
  CHECK(std::sqrt(bias / (3 * kSeeds)) == Approx(0.1).epsilon(few));
}

TEST_CASE("Readings beyond the range are cut off, and stamps are late by the delay", "[imu]") {
  const CameraPath still(3, Eigen::Isometry3d::Identity());
  ImuSettings settings = kNoiseFree;
  settings.accelerometer_range = 5.0;
  settings.delay_s = 0.02;
  const auto readings = imu_readings(still, kImuFps, settings, 1);
  CHECK(readings.front().specific_force == Eigen::Vector3d(0, -5, 0));
  std::ostringstream rows;
  write_imu_rows(rows, {readings[0], readings[1]}, settings, 1'000'000'000'000'000'000);
  const std::string text = rows.str();
  CHECK(text.find("\n1000000000020000000,0,0,0,0,-5,0\n1000000000025000000,") != std::string::npos);
}

TEST_CASE("The truth has the velocity and the biases of every frame", "[imu]") {
  const CameraPath path = street_loop(50, kImuFps);
  const auto readings = imu_readings(path, kImuFps, {}, 3);
  const auto truth = imu_truth(path, kImuFps, readings, {});
  REQUIRE(truth.size() == 50);
  const Eigen::Vector3d mean = (path[21].translation() - path[19].translation()) * kImuFps / 2;
  CHECK((truth[20].velocity - mean).norm() <= 0.05 * mean.norm());
  CHECK(truth[20].gyroscope_bias == readings[400].gyroscope_bias);
  CHECK(truth[49].accelerometer_bias == readings[980].accelerometer_bias);
}

TEST_CASE("Readings repeat with their seed", "[imu]") {
  const CameraPath path = street_loop(20, kImuFps);
  const auto a = imu_readings(path, kImuFps, {}, 1), b = imu_readings(path, kImuFps, {}, 1),
             c = imu_readings(path, kImuFps, {}, 2);
  CHECK(a.back().specific_force == b.back().specific_force);
  CHECK(a.back().specific_force != c.back().specific_force);
}

TEST_CASE("Settings of an IMU that make no sense are refused with the value", "[imu][error]") {
  ImuSettings settings;
  settings.rate_hz = 0.0;
  CHECK_THROWS_WITH(validate(settings), "imu.rate_hz must be in [10, 10000], not 0");
  settings = {};
  settings.gyroscope_noise = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_WITH(validate(settings), "imu.gyroscope_noise must be in [0, 1], not nan");
  settings = {};
  settings.accelerometer_range = -1.0;
  CHECK_THROWS_AS(validate(settings), std::invalid_argument);
}

}  // namespace
}  // namespace stereo_slam::simulator
