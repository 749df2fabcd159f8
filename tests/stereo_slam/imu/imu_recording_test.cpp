// SPDX-License-Identifier: MIT
#include "stereo_slam/imu/imu_recording.hpp"

#include <cmath>
#include <string>

#include <fmt/format.h>

#include "stereo_slam/imu/imu_samples_file.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

constexpr const char* kHeading = "#timestamp [ns],wx,wy,wz,ax,ay,az\n";

/// Rows at 200 Hz, with a rate of 0.1 rad/s about x.
[[nodiscard]] std::string rows(int begin, int end) {
  std::string text;
  for (int i = begin; i < end; ++i)
    text += fmt::format("{},0.1,0,0,0,{},9.81\n", 5'000'000LL * i, 0.001 * (i % 7));
  return text;
}

[[nodiscard]] ImuSamples read(const std::string& text) {
  const TemporaryFolder folder;
  write_text(folder / "imu.csv", text);
  return read_imu_samples(folder / "imu.csv");
}

[[nodiscard]] std::string error_of(const std::string& text) {
  return message_of([&] { (void)read(text); });
}

[[nodiscard]] ImuRecording read_with(const std::string& description) {
  const TemporaryFolder folder;
  write_text(folder / "imu.csv", kHeading + rows(0, 100));
  write_text(folder / "imu.yaml", description);
  return read_imu(folder / "imu.csv", {.T_body_camera = Eigen::Isometry3d::Identity()});
}

}  // namespace

TEST_CASE("Samples of an IMU are read, with or without heading, in nanoseconds or seconds", "[imu]") {
  const ImuSamples samples = read(kHeading + rows(0, 100));
  REQUIRE(samples.samples.size() == 100);
  CHECK(samples.samples[3].stamp_ns == 15'000'000);
  CHECK(samples.samples[3].angular_velocity == Eigen::Vector3d(0.1, 0, 0));
  CHECK(samples.samples[3].specific_force == Eigen::Vector3d(0, 0.003, 9.81));
  CHECK(samples.faults.texts().empty());
  CHECK(read("t,wx,wy,wz,ax,ay,az\n" + rows(0, 9)).samples.size() == 9);
  CHECK(read(rows(0, 9)).samples.size() == 9);
  CHECK(read("1.005,1,2,3,4,5,6\n1.010,1,2,3,4,5,6\n").samples[0].stamp_ns == 1'005'000'000);
  CHECK(read("1;1;2;3;4;5;6;20.5\n5000001;1;2;3;4;5;6;20.5\n").samples.size() == 2);
}

TEST_CASE("Faults of samples are counted, and the samples do without them", "[imu][faults]") {
  const auto faults_of = [](const std::string& text) { return read(text).faults; };
  CHECK(faults_of(rows(0, 9) + "45000000,nan,0,0,0,0,9.81\n50000000,0.1,0\n" + rows(11, 20)).unreadable == 2);
  CHECK(faults_of(rows(0, 9) + "45000000,1e300,0,0,0,0,1e308\n" + rows(11, 20)).unreadable == 1);
  CHECK(faults_of(rows(0, 9) + "x\n" + rows(9, 20)).first_unreadable == 10);
  CHECK(faults_of(rows(0, 9) + rows(8, 20)).repeated == 1);
  CHECK(faults_of(rows(10, 20) + rows(0, 10)).unsorted == 1);
  const ImuFaults gap = faults_of(rows(0, 9) + rows(29, 40));
  CHECK(gap.gaps == 1);
  CHECK(gap.longest_gap_ns == 105'000'000);
  CHECK_THAT(gap.texts().at(0), Catch::Contains("missing for more than 30 ms 1 time, at most 0.105 s"));
  std::string saturated = rows(0, 9);
  for (int i = 9; i < 13; ++i) saturated += fmt::format("{},{},0,0,0,0,9.81\n", 5'000'000LL * i, -4.363);
  const ImuSamples left = read(saturated + rows(13, 20));
  CHECK(left.faults.saturated == 4);
  CHECK(left.samples.size() == 16);
  CHECK(read(rows(10, 20) + rows(0, 10)).samples.front().stamp_ns == 0);
}

TEST_CASE("A file that has no samples of an IMU is refused", "[imu][faults]") {
  CHECK_THAT(error_of(""), Catch::Contains("imu.csv: has fewer than two samples"));
  CHECK_THAT(error_of(kHeading), Catch::Contains("fewer than two samples"));
  CHECK_THAT(error_of("#\n1,2,3\n2,3,4\n"), Catch::Contains("imu.csv:2: is not 'stamp in ns, wx, wy, wz"));
  CHECK_THAT(error_of(rows(0, 2) + "a\nb\nc\n"), Catch::Contains("3 of 5 rows"));
  CHECK_THAT(message_of([] { (void)read_imu_samples("no/such.csv"); }), Catch::Contains("no/such.csv"));
}

TEST_CASE("The description gives densities, axes and delay of an IMU", "[imu]") {
  const ImuRecording imu = read_with(
      "gyroscope_noise_density: 1e-3\ngyroscope_random_walk: 2e-5\naccelerometer_noise_density: 3e-2\n"
      "accelerometer_random_walk: 4e-3\ntimeshift_cam_imu: 0.02\n"
      "T_BS:\n  rows: 4\n  cols: 4\n  data: [0,-1,0,0.1, 1,0,0,0, 0,0,1,0, 0,0,0,1]\n");
  CHECK(imu.sensor.noise.gyroscope == 1e-3);
  CHECK(imu.sensor.noise.gyroscope_bias_walk == 2e-5);
  CHECK(imu.sensor.noise.accelerometer == 3e-2);
  CHECK(imu.sensor.noise.accelerometer_bias_walk == 4e-3);
  CHECK(imu.samples.front().stamp_ns == -20'000'000);  // the camera's clock is earlier
  CHECK((imu.sensor.T_camera_imu * Eigen::Vector3d(1, 0, 0) - Eigen::Vector3d(0.1, 1, 0)).norm() < 1e-12);
  // Four digits are enough of a rotation, here by 30 degrees.
  const ImuRecording turned =
      read_with("T_BS:\n  rows: 4\n  cols: 4\n  data: [0.8660,-0.5,0,0, 0.5,0.8660,0,0, 0,0,1,0, 0,0,0,1]\n");
  CHECK(turned.sensor.T_camera_imu.rotation()[3] == Approx(std::sin(0.5 * 0.5235988)).epsilon(1e-4));
  CHECK(read_with("imu0:\n  accelerometer_noise_density: 0.5\n  update_rate: 200\n")
            .sensor.noise.accelerometer == 0.5);
  CHECK(read_with("rate_hz: 200\n").sensor.noise.gyroscope == ImuSensor{}.noise.gyroscope);
  for (const std::string bad : {"-1", "0", "nan", "11", "x"}) {
    const auto message = message_of([&] { (void)read_with("gyroscope_noise_density: " + bad + "\n"); });
    CHECK_THAT(message, Catch::Contains("imu.yaml:1: gyroscope_noise_density"));
  }
  CHECK_THAT(message_of([&] { (void)read_with("timeshift_cam_imu: 20\n"); }),
             Catch::Contains("must be within 10 s"));
}

TEST_CASE("The pose of the camera in the body turns the axes of the IMU", "[imu]") {
  const TemporaryFolder folder;
  write_text(folder / "imu.csv", rows(0, 9));
  Eigen::Isometry3d T_body_camera = Eigen::Isometry3d::Identity();
  T_body_camera.translation() = Eigen::Vector3d(0.5, 0.0, 0.0);
  const ImuRecording imu = read_imu(folder / "imu.csv", {.T_body_camera = T_body_camera});
  CHECK((imu.sensor.T_camera_imu * Eigen::Vector3d::Zero() - Eigen::Vector3d(-0.5, 0, 0)).norm() < 1e-12);
}

TEST_CASE("An IMU whose pose in the axes of the camera is not known is refused", "[imu][faults]") {
  const TemporaryFolder folder;
  write_text(folder / "imu.csv", rows(0, 9));
  CHECK_THAT(message_of([&] { (void)read_imu(folder / "imu.csv", {}); }),
             Catch::Contains("imu.csv: the pose of the camera in the axes of this IMU is not known; give a"));
}

TEST_CASE("The delay of the calibration is taken out of the stamps, and one that contradicts it is refused",
          "[imu]") {
  const TemporaryFolder folder;
  write_text(folder / "imu.csv", rows(0, 9));
  const CameraAndImu camera{.T_body_camera = Eigen::Isometry3d::Identity(), .later_ns = 20'000'000};
  const ImuRecording imu = read_imu(folder / "imu.csv", camera);
  CHECK(imu.samples.front().stamp_ns == -20'000'000);
  CHECK(imu.sensor.known_delay_ns == 20'000'000);
  CHECK(imu.sensor.delay_sigma_s == kKnownDelaySigma_s);
  const CameraAndImu undelayed{.T_body_camera = Eigen::Isometry3d::Identity()};
  CHECK(read_imu(folder / "imu.csv", undelayed).sensor.delay_sigma_s == kUnknownDelaySigma_s);
  write_text(folder / "imu.yaml", "timeshift_cam_imu: 0.02\n");
  CHECK(read_imu(folder / "imu.csv", camera).samples.front().stamp_ns == -20'000'000);  // once
  write_text(folder / "imu.yaml", "timeshift_cam_imu: -0.02\n");
  CHECK_THAT(message_of([&] { (void)read_imu(folder / "imu.csv", camera); }),
             Catch::Contains("imu.yaml: timeshift_cam_imu is -0.02 s, but 0.02 s in the calibration"));
}

TEST_CASE("The IMU of a recording is found in EuRoC's layout and as imu.csv", "[imu]") {
  const TemporaryFolder folder;
  CHECK_FALSE(find_imu(folder.path()));
  write_text(folder / "imu.csv", rows(0, 9));
  CHECK(find_imu(folder.path())->filename() == "imu.csv");
  fs::create_directories(folder / "mav0/imu0");
  write_text(folder / "mav0/imu0/data.csv", rows(0, 9));
  CHECK(find_imu(folder.path())->filename() == "data.csv");
}

TEST_CASE("Frames get the samples since the frame before, and a quarter of a second more", "[imu]") {
  const ImuRecording imu{.file = {}, .sensor = {}, .samples = read(rows(0, 100)).samples, .faults = {}};
  ImuFeed feed(imu);
  CHECK(feed.until(22'000'000).samples.size() == 56);  // 0 to 275 ms
  const auto second = feed.until(50'000'000).samples;
  REQUIRE(second.size() == 5);
  CHECK(second.front().stamp_ns == 280'000'000);
  CHECK(second.back().stamp_ns == 300'000'000);
  CHECK(feed.until(50'000'000).samples.empty());
  CHECK(feed.until(10'000'000'000).samples.size() == 39);
  CHECK(feed.until(20'000'000'000).samples.empty());
}

TEST_CASE("An IMU of another clock is refused", "[imu][faults]") {
  const ImuRecording imu{
      .file = "imu.csv", .sensor = {}, .samples = read(rows(0, 100)).samples, .faults = {}};
  CHECK_FALSE(check_overlap(imu, 100'000'000, 400'000'000));
  CHECK(check_overlap(imu, 100'000'000, 10'000'000'000).value_or("") ==
        "the first 0.0 s and the last 9.5 s of the frames have no samples; there the images are used alone");
  CHECK_THAT(
      message_of([&] { (void)check_overlap(imu, 1'000'000'000, 2'000'000'000); }),
      Catch::Contains("imu.csv: has samples from 0.000000000 s to 0.495000000 s, but the frames are from"));
}
