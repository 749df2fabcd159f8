// SPDX-License-Identifier: MIT
#include <algorithm>
#include <functional>
#include <sstream>

#include "stereo_slam/support/db3_writer.hpp"
#include "stereo_slam/support/mcap_writer.hpp"
#include "stereo_slam/support/program.hpp"

using namespace stereo_slam::test;

namespace {

/// A rendered drive with an IMU, in `folder`/drive.
void render_drive(const TemporaryFolder& folder, int frames) {
  const auto result =
      call({"simulate", "--quiet", "--output", folder / "drive", "--frames", std::to_string(frames), "--fps",
            "20", "--scale", "0.35", "--imu", "--threads", "2"});
  REQUIRE(result.status == 0);
}

[[nodiscard]] Result run_with(const TemporaryFolder& folder, const std::vector<std::string>& options,
                              const std::string& threads = "2") {
  std::vector<std::string> all = {"run",          "--dataset",   folder / "drive", "--output",
                                  folder / "out", "--overwrite", "--json",         folder / "run.json",
                                  "--threads",    threads};
  all.insert(all.end(), options.begin(), options.end());
  return call(all);
}

/// Rewrites imu.csv with other readings.
void distort(const std::string& csv, const std::function<void(std::vector<double>&)>& change) {
  std::string text;
  for (const auto& line : split_lines(read_text(csv))) {
    if (line.starts_with("#")) continue;
    std::vector<double> numbers;
    std::string field;
    std::istringstream stream(line);
    while (std::getline(stream, field, ',')) numbers.push_back(std::stod(field));
    change(numbers);
    text += line.substr(0, line.find(','));
    for (std::size_t i = 1; i < numbers.size(); ++i) text += fmt::format(",{}", numbers[i]);
    text += '\n';
  }
  write_text(csv, text);
}

/// The recording in a folder of EuRoC's layout, as messages.
[[nodiscard]] std::vector<TestMessage> messages_of(const fs::path& mav0) {
  std::vector<TestMessage> messages;
  for (const std::string camera : {"cam0", "cam1"}) {
    for (const auto& line : split_lines(read_text(mav0 / camera / "data.csv"))) {
      if (line.starts_with("#")) continue;
      const std::int64_t stamp_ns = std::stoll(line);
      const cv::Mat image = cv::imread((mav0 / camera / "data" / line.substr(line.find(',') + 1)).string(),
                                       cv::IMREAD_GRAYSCALE);
      REQUIRE_FALSE(image.empty());
      messages.push_back({"/" + camera + "/image_raw", "sensor_msgs/msg/Image", stamp_ns,
                          cdr_image({.stamp_ns = stamp_ns,
                                     .width = static_cast<std::uint32_t>(image.cols),
                                     .height = static_cast<std::uint32_t>(image.rows),
                                     .step = static_cast<std::uint32_t>(image.cols),
                                     .data = {image.datastart, image.dataend}},
                                    false)});
    }
  }
  for (const auto& line : split_lines(read_text(mav0 / "imu0/data.csv"))) {
    if (line.starts_with("#")) continue;
    CdrImu imu{.stamp_ns = std::stoll(line)};
    std::istringstream fields(line.substr(line.find(',')));
    char comma = 0;
    for (auto* vector : {&imu.angular_velocity, &imu.linear_acceleration}) {
      for (double& number : *vector) fields >> comma >> number;
    }
    messages.push_back({"/imu0", "sensor_msgs/msg/Imu", imu.stamp_ns, cdr_imu(imu, false)});
  }
  std::ranges::stable_sort(messages, {}, &TestMessage::record_ns);
  return messages;
}

}  // namespace

TEST_CASE("run --imu uses the recording's IMU, and writes what it tells", "[cli][imu]") {
  const TemporaryFolder folder;
  render_drive(folder, 40);
  const auto without = run_with(folder, {});
  CHECK(without.status == 0);
  const std::string poses = read_text(folder / "out/trajectory_kitti.txt");
  CHECK_FALSE(fs::exists(folder / "out/inertial.csv"));
  CHECK_THAT(read_text(folder / "run.json"), !Catch::Contains("\"imu\""));

  const auto with = run_with(folder, {"--imu"});
  CAPTURE(with.err);
  CHECK(with.status == 0);
  CHECK_THAT(read_text(folder / "run.json"), Catch::Contains("\"phase\": \"running\""));
  CHECK_THAT(read_text(folder / "out/run.yaml"), Catch::Contains("phase: running"));
  const auto rows = split_lines(read_text(folder / "out/inertial.csv"));
  REQUIRE(rows.size() == 41);
  CHECK_THAT(rows.front(), Catch::StartsWith("stamp_s,phase,vx_m_s,") && Catch::EndsWith(",p_12_12"));
  CHECK_THAT(rows[1], Catch::Contains(",starting,,,"));
  CHECK_THAT(rows.back(), Catch::Contains(",running,"));
  const auto fields = [](const std::string& row) { return std::count(row.begin(), row.end(), ','); };
  CHECK(fields(rows.front()) == 1 + 13 + 91);
  CHECK(fields(rows[1]) == fields(rows.front()));
  CHECK(fields(rows.back()) == fields(rows.front()));
  CHECK(read_text(folder / "out/trajectory_kitti.txt") != poses);

  const auto named = run_with(folder, {"--imu-file", folder / "drive/imu.csv"}, "1");
  CHECK(named.status == 0);
  CHECK(split_lines(read_text(folder / "out/inertial.csv")) == rows);  // and with one thread

  (void)run_with(folder, {});
  CHECK(read_text(folder / "out/trajectory_kitti.txt") == poses);
  CHECK_FALSE(fs::exists(folder / "out/inertial.csv"));
}

TEST_CASE("An IMU in other units is switched off with a warning, and the run goes on", "[cli][imu][faults]") {
  const TemporaryFolder folder;
  render_drive(folder, 60);  // the start is tried twice, for a second each
  CHECK(run_with(folder, {}).status == 0);
  const std::string poses = read_text(folder / "out/trajectory_kitti.txt");
  distort(folder / "drive/imu.csv", [](std::vector<double>& row) {
    for (std::size_t i = 4; i < 7; ++i) row[i] /= 9.80665;
  });
  const auto run = run_with(folder, {"--imu"});
  CHECK(run.status == 0);
  CHECK_THAT(run.err,
             Catch::Contains("the IMU contradicts the images and was switched off before it was used") &&
                 Catch::Contains("multiples of gravity"));
  CHECK_THAT(read_text(folder / "run.json"),
             Catch::Contains("\"phase\": \"off\"") && Catch::Contains("\"fault\""));
  CHECK_THAT(read_text(folder / "out/run.yaml"), Catch::Contains("multiples of gravity"));
  CHECK(read_text(folder / "out/trajectory_kitti.txt") == poses);  // it was never used
}

TEST_CASE("Half a second without images is bridged by the IMU", "[cli][imu]") {
  const TemporaryFolder folder;
  render_drive(folder, 50);
  for (int i = 35; i < 45; ++i) {
    for (const auto* camera : {"image_0", "image_1"})
      fs::remove(fs::path(folder / "drive") / camera / fmt::format("{:06}.png", i));
  }
  CHECK(run_with(folder, {"--imu"}).status == 0);
  const std::string bridged = read_text(folder / "out/covariances.csv");
  CHECK_THAT(bridged, !Catch::Contains("LOST"));
  CHECK_THAT(read_text(folder / "run.json"), Catch::Contains("\"imu_alone\": 10"));
  CHECK(run_with(folder, {}).status == 0);
  CHECK_THAT(read_text(folder / "out/covariances.csv"), Catch::Contains("LOST"));
}

TEST_CASE("An IMU that is not there, or of another clock, is an error before the run", "[cli][imu][faults]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "drive", 3);
  check_one_line_failure(run_with(folder, {"--imu"}), "has no samples of an IMU (imu0/data.csv or imu.csv)");
  check_one_line_failure(run_with(folder, {"--imu-file", folder / "no.csv"}), "no.csv");
  write_text(folder / "drive/imu.csv", "1000000000000,0,0,0,0,0,9.81\n1000005000000,0,0,0,0,0,9.81\n");
  check_one_line_failure(run_with(folder, {"--imu"}),
                         "the pose of the camera in the axes of this IMU is not known");
  write_text(folder / "drive/imu.yaml", "T_BS: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n");
  check_one_line_failure(run_with(folder, {"--imu"}), "write the stamps of both in the same clock");
  CHECK_FALSE(fs::exists(folder / "out"));
}

TEST_CASE("A recording with an IMU gives the same bits as a folder and as a bag", "[cli][imu][bags]") {
  const TemporaryFolder folder;
  REQUIRE(call({"simulate", "--quiet", "--output", folder / "drive", "--format", "euroc", "--frames", "30",
                "--fps", "20", "--scale", "0.35", "--imu", "--threads", "2"})
              .status == 0);
  REQUIRE(run_with(folder, {"--imu"}).status == 0);
  const std::string poses = read_text(folder / "out/trajectory_tum.txt");
  const std::string velocities = read_text(folder / "out/inertial.csv");
  CHECK_THAT(velocities, Catch::Contains(",running,"));
  const fs::path drive = folder / "drive";
  const auto messages = messages_of(drive / "mav0");
  write_text(drive / "drive.mcap", mcap_of(messages).bytes);
  write_db3(drive / "drive.db3", messages);
  for (const auto* bag : {"drive.mcap", "drive.db3"}) {
    CAPTURE(bag);
    const auto run =
        call({"run", "--dataset", drive / bag, "--output", folder / "out", "--overwrite", "--imu"});
    CAPTURE(run.err);
    REQUIRE(run.status == 0);
    CHECK(read_text(folder / "out/trajectory_tum.txt") == poses);
    CHECK(read_text(folder / "out/inertial.csv") == velocities);
  }
  check_one_line_failure(
      call({"run", "--dataset", drive / "drive.mcap", "--output", folder / "other", "--imu-topic", "/imu1"}),
      "'/imu1' is no topic of an IMU (sensor_msgs/Imu); there are /imu0");
}

TEST_CASE("timeshift_cam_imu is added to the stamps of the camera, and one with the wrong sign is noticed",
          "[cli][imu]") {
  const TemporaryFolder folder;
  render_drive(folder, 70);
  const std::string samples = read_text(folder / "drive/imu.csv"),
                    description = read_text(folder / "drive/imu.yaml");
  write_text(folder / "drive/imu.yaml", description + "timeshift_cam_imu: 0\n");
  REQUIRE(run_with(folder, {"--imu"}).status == 0);
  const std::string poses = read_text(folder / "out/trajectory_tum.txt");
  std::string later;
  for (const auto& line : split_lines(samples)) {
    if (line.starts_with("#")) continue;
    later += fmt::format("{}{}\n", std::stoll(line) + 15'000'000, line.substr(line.find(',')));
  }
  write_text(folder / "drive/imu.csv", later);
  write_text(folder / "drive/imu.yaml", description + "timeshift_cam_imu: 0.015\n");
  const auto right = run_with(folder, {"--imu"});
  CHECK(right.status == 0);
  CHECK_THAT(right.err, !Catch::Contains("stamps of the IMU"));
  CHECK(read_text(folder / "out/trajectory_tum.txt") == poses);

  write_text(folder / "drive/imu.yaml", description + "timeshift_cam_imu: -0.015\n");
  const auto wrong = run_with(folder, {"--imu"});
  CHECK(wrong.status == 0);
  CAPTURE(wrong.err);
  CHECK_THAT(wrong.err,
             Catch::Contains("later than those of the images and the known delay, which was corrected "
                             "while driving; set timeshift_cam_imu to 0.01"));
}
