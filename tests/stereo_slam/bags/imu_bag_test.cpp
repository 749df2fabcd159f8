// SPDX-License-Identifier: MIT
// The readings of an IMU in bags.
#include <functional>
#include <limits>

#include "stereo_slam/bags/bag_recording.hpp"
#include "stereo_slam/dataset/sequence.hpp"
#include "stereo_slam/support/bags.hpp"
#include "stereo_slam/support/db3_writer.hpp"
#include "stereo_slam/support/mcap_writer.hpp"
#include "stereo_slam/support/recorded_drive.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

constexpr int kSamples = 100;
constexpr const char* kDescription =
    "accelerometer_noise_density: 0.05\nT_BS:\n  rows: 4\n  cols: 4\n"
    "  data: [0,-1,0,0.1, 1,0,0,0, 0,0,1,0, 0,0,0,1]\n";

/// Sample `i` of a bag, at 200 Hz.
[[nodiscard]] CdrImu sample(int i) {
  return {.stamp_ns = kDriveStart_ns + 5'000'000LL * i,
          .angular_velocity = {0.1, 0.0, 0.001 * (i % 7)},
          .linear_acceleration = {0.0, -0.01 * (i % 5), 9.81}};
}

using Change = std::function<void(int, CdrImu&)>;

/// The tiny drive with samples on /imu0, each recorded a millisecond after its stamp.
[[nodiscard]] std::vector<TestMessage> drive_with_imu(const Change& change = {}, bool big_endian = false) {
  auto messages = drive_messages({.big_endian = big_endian});
  for (int i = 0; i < kSamples; ++i) {
    CdrImu imu = sample(i);
    const std::int64_t record_ns = imu.stamp_ns + 1'000'000;
    if (change) change(i, imu);
    messages.push_back({"/imu0", "sensor_msgs/msg/Imu", record_ns, cdr_imu(imu, big_endian)});
  }
  return messages;
}

struct Found {
  std::shared_ptr<const ImuRecording> imu;
  std::vector<std::string> problems;
};

[[nodiscard]] Found imu_of(const fs::path& bag, const BagOptions& options = {}) {
  SequenceScan scan = scan_bag(bag, options);
  for (const auto& problem : scan.problems) FAIL(problem.text);
  add_imu(scan, {});
  Found found{.imu = scan.sequence.imu, .problems = {}};
  for (const auto& problem : scan.problems) found.problems.push_back(problem.text);
  return found;
}

/// The IMU of a bag with these messages, with a description beside it.
[[nodiscard]] Found imu_in(const std::vector<TestMessage>& messages, const BagOptions& options = {},
                           const std::string& description = kDescription) {
  const TemporaryFolder folder;
  write_text(folder / "drive.mcap", mcap_of(messages).bytes);
  if (!description.empty()) write_text(folder / "imu.yaml", description);
  return imu_of(folder / "drive.mcap", options);
}

/// The only problem of an IMU that cannot be used.
[[nodiscard]] std::string refusal_of(const Found& found) {
  CHECK_FALSE(found.imu);
  REQUIRE(found.problems.size() == 1);
  return found.problems[0];
}

void check_samples(const Found& found) {
  CHECK(found.problems.empty());
  REQUIRE(found.imu);
  REQUIRE(found.imu->samples.size() == kSamples);
  for (int i = 0; i < kSamples; ++i) {
    const auto& [stamp_ns, rate, force] = found.imu->samples[static_cast<std::size_t>(i)];
    const CdrImu expected = sample(i);
    CHECK(stamp_ns == expected.stamp_ns);
    CHECK(rate == Eigen::Vector3d(expected.angular_velocity.data()));
    CHECK(force == Eigen::Vector3d(expected.linear_acceleration.data()));
  }
  CHECK(found.imu->sensor.noise.accelerometer == 0.05);
  CHECK((found.imu->sensor.T_camera_imu * Eigen::Vector3d(1, 0, 0) - Eigen::Vector3d(0.1, 1, 0)).norm() <
        1e-12);
}

}  // namespace

TEST_CASE("The samples of an IMU in every kind of bag are those that were recorded", "[bags][imu]") {
  const TemporaryFolder folder;
  write_text(folder / "imu.yaml", kDescription);
  for (const bool big_endian : {false, true}) {
    const auto messages = drive_with_imu({}, big_endian);
    for (const auto* compression : {"", "lz4", "zstd"}) {
      write_text(folder / "drive.mcap", mcap_of(messages, {.compression = compression}).bytes);
      check_samples(imu_of(folder / "drive.mcap"));
    }
    fs::remove(folder / "drive.db3");
    write_db3(folder / "drive.db3", messages);
    check_samples(imu_of(folder / "drive.db3"));
  }
  const auto ros1 = bags();
  if (!ros1) return;
  fs::copy_file(*ros1 / "imu.bag", folder / "imu.bag");
  check_samples(imu_of(folder / "imu.bag"));
}

TEST_CASE("Samples of an IMU have the times of recording if the images have them", "[bags][imu]") {
  const auto found = imu_in(drive_with_imu(), {.record_times = true});
  REQUIRE(found.imu);
  CHECK(found.imu->samples[3].stamp_ns == kDriveStart_ns + 16'000'000);
}

TEST_CASE("Faults of the messages of an IMU are counted, and the samples do without them",
          "[bags][imu][faults]") {
  auto messages = drive_with_imu([](int i, CdrImu& imu) {
    if (i == 7) imu.angular_velocity[0] = std::numeric_limits<double>::quiet_NaN();
    if (i == 20) imu.linear_acceleration[1] = 1e9;
    if (i == 30) imu.stamp_ns -= 5'000'000;
  });
  messages.back().bytes.resize(60);
  const auto found = imu_in(messages);
  REQUIRE(found.imu);
  CHECK(found.imu->samples.size() == kSamples - 4);
  REQUIRE(found.problems.size() == 2);
  CHECK_THAT(
      found.problems[0],
      Catch::Contains("drive.mcap: 3 of 100 messages are not a stamp and six numbers within 100000 and "
                      "were left out, the first in message 7"));
  CHECK_THAT(found.problems[1], Catch::Contains("1 of 100 messages had the stamp of another message"));
}

TEST_CASE("An IMU that a bag does not have, or not as a whole, is an error that says what to do",
          "[bags][imu][faults]") {
  CHECK_THAT(
      refusal_of(imu_in(drive_messages())),
      Catch::Contains("drive.mcap: has no messages of an IMU (sensor_msgs/Imu); name a file of samples: "
                      "--imu-file"));
  const auto rates_alone =
      drive_with_imu([](int, CdrImu& imu) { imu.linear_acceleration_covariance = -1.0; });
  CHECK_THAT(refusal_of(imu_in(rates_alone)),
             Catch::Contains("drive.mcap: /imu0: 100 of its 100 messages cannot be used, the first because "
                             "linear_acceleration_covariance[0] is -1, which says that there is no "
                             "linear_acceleration; name a topic with rates and specific forces"));
  CHECK_THAT(refusal_of(imu_in(drive_with_imu([](int, CdrImu& imu) { imu.stamp_ns = 0; }))),
             Catch::Contains("the stamps in its headers are zero; the option --record-times"));
  const auto other_clock = drive_with_imu([](int, CdrImu& imu) { imu.stamp_ns -= kDriveStart_ns; });
  CHECK_THAT(refusal_of(imu_in(other_clock)), Catch::Contains("write the stamps of both in the same clock"));
  CHECK_THAT(refusal_of(imu_in(drive_with_imu(), {}, "")),
             Catch::Contains("the pose of the camera in the axes of this IMU is not known"));
  CHECK_THAT(refusal_of(imu_in(drive_with_imu(), {}, "gyroscope_noise_density: -1\n")),
             Catch::Contains("imu.yaml:1: gyroscope_noise_density is -1"));
}

TEST_CASE("The topic of the IMU is the only one with messages, or is named", "[bags][imu]") {
  auto messages = drive_with_imu();
  messages.push_back({"/flight/imu", "sensor_msgs/msg/Imu", kDriveStart_ns, cdr_imu(sample(0), false)});
  CHECK_THAT(
      refusal_of(imu_in(messages)),
      Catch::Contains("has several topics of an IMU; name one: --imu-topic; there are /flight/imu, /imu0"));
  check_samples(imu_in(messages, {.imu_topic = "/imu0"}));
  CHECK_THAT(
      refusal_of(imu_in(messages, {.imu_topic = "/note"})),
      Catch::Contains("'/note' is no topic of an IMU (sensor_msgs/Imu); there are /flight/imu, /imu0"));
}

TEST_CASE(
    "Kalibr's camchain has the pose of the IMU of a bag and its delay, and imu.yaml beside it the noise",
    "[bags][imu]") {
  const std::string lens =
      "  camera_model: pinhole\n  intrinsics: [200, 200, 160, 60]\n  resolution: [320, 120]\n"
      "  distortion_model: radtan\n  distortion_coeffs: [0, 0, 0, 0]\n";
  const std::string camchain = "cam0:\n" + lens +
                               "  T_cam_imu: [[1,0,0,0.2],[0,1,0,0],[0,0,1,0],[0,0,0,1]]\n"
                               "  timeshift_cam_imu: 0.015\n"
                               "cam1:\n" +
                               lens + "  T_cn_cnm1: [[1,0,0,-0.4],[0,1,0,0],[0,0,1,0],[0,0,0,1]]\n";
  const TemporaryFolder calibration;
  write_text(calibration / "camchain-imucam.yaml", camchain);
  write_text(calibration / "imu.yaml",
             "rostopic: /imu0\naccelerometer_noise_density: 0.07\nupdate_rate: 200.0\n");
  const BagOptions options{.calibration = calibration / "camchain-imucam.yaml"};
  const Found found = imu_in(drive_with_imu(), options, "");
  CHECK(found.problems.empty());
  REQUIRE(found.imu);
  CHECK(found.imu->sensor.noise.accelerometer == 0.07);
  CHECK(found.imu->sensor.known_delay_ns == 15'000'000);
  CHECK(found.imu->samples[0].stamp_ns == kDriveStart_ns - 15'000'000);
  CHECK((found.imu->sensor.T_camera_imu * Eigen::Vector3d::Zero() - Eigen::Vector3d(0.2, 0, 0)).norm() <
        1e-12);
  CHECK_THAT(refusal_of(imu_in(drive_with_imu(), options, "timeshift_cam_imu: -0.015\n")),
             Catch::Contains("imu.yaml: timeshift_cam_imu is -0.015 s, but 0.015 s in the calibration of the "
                             "cameras; remove the wrong one"));
}
