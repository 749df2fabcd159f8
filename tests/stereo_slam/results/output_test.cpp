// SPDX-License-Identifier: MIT
#include "stereo_slam/results/output.hpp"

#include <cstring>
#include <limits>
#include <map>
#include <sstream>
#include <unistd.h>

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include "stereo_slam/io/trajectory_io.hpp"
#include "stereo_slam/results/run_yaml.hpp"
#include "stereo_slam/settings/settings_io.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

RunRecord two_frames() {
  RunRecord record;
  record.results.resize(2);
  record.results[1].index = 1;
  record.results[1].stamp_ns = 100'000'000;
  record.results[1].status = TrackingStatus::kOk;
  record.results[0].times = {{"features", 1.5}};
  record.results[1].times = {{"features", 2.0}, {"odometry", 3.25}, {"features", 0.5}};
  record.total_ms = {2.0, 6.0};
  record.cpu_ms = {3.0, 8.25};
  record.read_cpu_ms = {0.5, 0.75};
  record.resident_mb = {std::numeric_limits<double>::quiet_NaN(), 123.45};
  record.trajectory.resize(2);
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) record.trajectory[1].covariance(i, j) = 10 * std::min(i, j) + std::max(i, j);
  }
  record.map_points = {{{1.0, -2.0, 3.0}, 200}, {{4.0, 5.0, 6.0}, 7}};
  return record;
}

}  // namespace

TEST_CASE("covariances.csv names every column and holds the upper triangle row by row", "[output]") {
  std::string zeros;
  for (int i = 0; i < 21; ++i) zeros += ",0";
  std::ostringstream out;
  write_covariances(out, two_frames());
  const auto lines = split_lines(out.str());
  REQUIRE(lines.size() == 3);
  CHECK_THAT(lines[0], Catch::StartsWith("stamp_s,status,rx_rx_rad2,rx_ry_rad2,rx_rz_rad2,rx_tx_rad_m"));
  CHECK_THAT(lines[0], Catch::Contains(",ty_tz_m2,tz_tz_m2,keyframe,nis,nis_dof,scale_sigma,axes_sigma_rad,"
                                       "common_error_rad,keyframe_rx_rx_rad2,"));
  CHECK_THAT(lines[0], Catch::EndsWith(",keyframe_tz_tz_m2,reasons"));
  CHECK(std::count(lines[0].begin(), lines[0].end(), ',') == 50);
  CHECK(lines[2] ==
        "0.100000000,OK,0,1,2,3,4,5,11,12,13,14,15,22,23,24,25,33,34,35,44,45,55,0,0,0,0,0,0" + zeros + ",");
}

TEST_CASE("The reasons are the last column of covariances.csv, whatever the status is", "[output]") {
  RunRecord record = two_frames();
  record.results[0].status = TrackingStatus::kLost;
  record.results[0].weak.right_image_unfit = true;
  record.results[1].weak = {.few_landmarks = true, .segment_not_localised = true};
  std::ostringstream out;
  write_covariances(out, record);
  const auto lines = split_lines(out.str());
  REQUIRE(lines.size() == 3);
  CHECK_THAT(lines[1], Catch::EndsWith(",0,right_image_unfit"));
  CHECK_THAT(lines[2], Catch::EndsWith(",0,few_landmarks;segment_not_localised"));
}

TEST_CASE("Frames are counted by reason, each status by itself", "[output]") {
  RunRecord record;
  record.results.resize(4);
  for (auto& result : record.results) {
    result.status = TrackingStatus::kWeak;
    result.weak.few_landmarks = true;
  }
  record.results[1].weak.segment_not_localised = true;
  record.results[2].status = TrackingStatus::kLost;
  record.results[3].status = TrackingStatus::kRelocalised;
  CHECK(count_reasons(record, TrackingStatus::kWeak) == ReasonCounts{0, 0, 0, 2, 0, 0, 0, 0, 1});
  CHECK(count_reasons(record, TrackingStatus::kLost) == ReasonCounts{0, 0, 0, 1, 0, 0, 0, 0, 0});
  CHECK(count_reasons(record, TrackingStatus::kOk) == ReasonCounts{});
}

TEST_CASE("timing.csv has a column for every stage; unknown memory is left empty", "[output]") {
  std::ostringstream out;
  write_timing(out, two_frames());
  CHECK(out.str() ==
        "frame,features_ms,odometry_ms,total_ms,cpu_ms,read_cpu_ms,rss_mb\n"
        "0,1.500,0.000,2.000,3.000,0.500,\n1,2.500,3.250,6.000,8.250,0.750,123.5\n");
}

namespace {

/// Frames at 0 and 100 ms, and two dropped between them, at 25 and 75 ms. The camera moves and turns.
RunRecord dropped_frames() {
  RunRecord record = two_frames();
  record.trajectory[1].pose = Pose::exp((Vector6<double>() << 0.0, 0.4, 0.0, 1.0, 2.0, 3.0).finished());
  record.realtime = RealtimeRecord{{{4.0, {}}, {12.5, {25'000'000, 75'000'000}}}, 0.25};
  return record;
}

}  // namespace

TEST_CASE("The KITTI trajectory of a run in real time has every frame, the others the processed ones",
          "[output]") {
  const TemporaryFolder folder;
  const RunRecord record = dropped_frames();
  write_results(folder.path(), record);
  CHECK(read_trajectory(folder / "trajectory_kitti.txt").poses.size() == 4);
  CHECK(read_trajectory(folder / "trajectory_tum.txt").poses.size() == 2);
  CHECK(read_trajectory(folder / "trajectory_online.txt").poses.size() == 2);
  CHECK(split_lines(read_text(folder / "covariances.csv")).size() == 3);
  const auto timing = split_lines(read_text(folder / "timing.csv"));
  CHECK_THAT(timing[0], Catch::EndsWith(",rss_mb,latency_ms,dropped"));
  CHECK_THAT(timing[1], Catch::EndsWith(",,4.000,0"));
  CHECK_THAT(timing[2], Catch::EndsWith(",123.5,12.500,2"));
}

TEST_CASE("A dropped frame is where a constant velocity between its neighbours puts it at its stamp",
          "[output]") {
  const auto poses = poses_of_all_frames(dropped_frames());
  REQUIRE(poses.size() == 4);
  const Vector6<double> whole = poses[3].log();
  CHECK((poses[1].log() - 0.25 * whole).norm() < 1e-14);
  CHECK((poses[2].log() - 0.75 * whole).norm() < 1e-14);
}

TEST_CASE("Frames dropped before the first processed one have its pose", "[output]") {
  RunRecord record = dropped_frames();
  record.trajectory[0].pose = Pose::exp((Vector6<double>() << 0.0, 0.0, 0.0, 1.0, 2.0, 3.0).finished());
  record.realtime->frames[0].dropped_ns = {-50'000'000, -25'000'000};
  const auto poses = poses_of_all_frames(record);
  REQUIRE(poses.size() == 6);
  for (std::size_t i = 0; i < 3; ++i) CHECK(poses[i].boxminus(record.trajectory[0].pose).norm() == 0.0);
}

TEST_CASE("The latency of a run in real time is summarised over its processed frames", "[output]") {
  CHECK_FALSE(realtime_summary(two_frames()));
  const auto summary = realtime_summary(dropped_frames());
  REQUIRE(summary);
  CHECK(summary->dropped == 2);
  CHECK(summary->median_ms == 12.5);
  CHECK(summary->max_ms == 12.5);
  CHECK(summary->reading_delay_s == 0.25);
}

TEST_CASE("The cost of a frame is order statistics of its time and means of its CPU time", "[output]") {
  RunRecord record;
  for (int i = 0; i < 20; ++i) {
    record.total_ms.push_back(i == 7 ? 100.0 : 20.0 - i);
    record.cpu_ms.push_back(i);
    record.read_cpu_ms.push_back(0.5 * i);
  }
  const FrameCost cost = frame_cost(record);  // sorted: 1 .. 12, 14 .. 20, 100
  CHECK(cost.median_ms == 11.0);
  CHECK(cost.p95_ms == 100.0);
  CHECK(cost.max_ms == 100.0);
  CHECK(cost.cpu_ms == 9.5);
  CHECK(cost.read_cpu_ms == 4.75);
  CHECK(frame_cost({}).median_ms == 0.0);
  CHECK(frame_cost({}).cpu_ms == 0.0);
}

TEST_CASE("map.ply holds every point in binary", "[output]") {
  std::ostringstream out;
  write_ply(out, two_frames().map_points);
  const std::string text = out.str();
  const auto body = text.find("end_header\n") + std::strlen("end_header\n");
  CHECK_THAT(text, Catch::StartsWith("ply\nformat binary_little_endian 1.0\nelement vertex 2\n"));
  REQUIRE(text.size() == body + 2 * 15);
  float xyz[3];
  std::memcpy(xyz, text.data() + body + 15, sizeof(xyz));
  CHECK(xyz[0] == 4.0F);
  CHECK(xyz[2] == 6.0F);
  CHECK(text.back() == 7);
}

TEST_CASE("All result files of an empty run are valid", "[output]") {
  const TemporaryFolder folder;
  write_results(folder.path(), {});
  CHECK(read_text(folder / "trajectory_kitti.txt").empty());
  CHECK(split_lines(read_text(folder / "covariances.csv")).size() == 1);
  CHECK(read_text(folder / "timing.csv") == "frame,total_ms,cpu_ms,read_cpu_ms,rss_mb\n");
  CHECK_THAT(read_text(folder / "map.ply"), Catch::Contains("element vertex 0"));
}

TEST_CASE("load_settings reads the settings of a run.yaml", "[output]") {
  const TemporaryFolder folder;
  Settings settings;
  settings.seed = 77;
  settings.features.count = 321;
  StereoSequence sequence;
  sequence.folder = "a: strange \"name\"";
  write_run_yaml(folder.path(), {"failed", "frame 3: it \"broke\"", 3, 1.5}, sequence, settings);
  const Settings read = load_settings(folder / "run.yaml");
  CHECK(read.seed == 77);
  CHECK(read.features.count == 321);
  CHECK_THAT(read_text(folder / "run.yaml"), Catch::Contains("state: failed"));
}

TEST_CASE("run.yaml leaves out unknown memory", "[output]") {
  const TemporaryFolder folder;
  StereoSequence sequence;
  sequence.folder = "street";
  const auto yaml = [&](const RunHeader& header) {
    write_run_yaml(folder.path(), header, sequence, {});
    return read_text(folder / "run.yaml");
  };
  RunHeader header{.state = "finished", .error = ""};
  CHECK_THAT(yaml(header), !Catch::Contains("peak_mb") && !Catch::Contains("bytes_per_keyframe"));
  header.peak_mb = 321.04;
  header.bytes_per_keyframe = 55000;
  CHECK_THAT(yaml(header), Catch::Contains("peak_mb: 321.0") && Catch::Contains("bytes_per_keyframe: 55000"));
}

TEST_CASE("run.yaml counts the weak frames by reason, and leaves out reasons that none has", "[output]") {
  const TemporaryFolder folder;
  StereoSequence sequence;
  sequence.folder = "street";
  const auto counts = [&](const ReasonCounts& weak) {
    RunHeader header{.state = "finished", .error = ""};
    header.weak_frames_by_reason = weak;
    write_run_yaml(folder.path(), header, sequence, {});
    return YAML::LoadFile((folder / "run.yaml").string())["weak_frames_by_reason"]
        .as<std::map<std::string, int>>();
  };
  CHECK(counts({}).empty());
  CHECK(counts({0, 0, 0, 8, 0, 0, 0, 0, 5}) ==
        std::map<std::string, int>{{"few_landmarks", 8}, {"segment_not_localised", 5}});
  write_run_yaml(folder.path(), {.state = "running", .error = ""}, sequence, {});  // not known yet
  CHECK_FALSE(YAML::LoadFile((folder / "run.yaml").string())["weak_frames_by_reason"]);
}

TEST_CASE("A result file that cannot be written does not prevent the others", "[output]") {
  const TemporaryFolder folder;
  fs::create_directories(folder / "trajectory_tum.txt");
  CHECK_THAT(message_of([&] { write_results(folder.path(), two_frames()); }),
             Catch::Contains("trajectory_tum.txt: is a folder"));
  CHECK(split_lines(read_text(folder / "covariances.csv")).size() == 3);
}

TEST_CASE("A run.yaml that cannot be replaced still says that the run failed", "[output]") {
  const TemporaryFolder folder;
  StereoSequence sequence;
  sequence.folder = folder.path();
  write_run_yaml(folder.path(), {"running", ""}, sequence, {});
  const std::string before = read_text(folder / "run.yaml");
  for (int i = 0; i < 100; ++i)  // the names of temporary files that write_file() tries
    write_text(folder / fmt::format("run.yaml.partial-{}-{}", ::getpid(), i), "");
  CHECK_THAT(message_of([&] {
               write_run_yaml(folder.path(), {"finished", ""}, sequence, {});
             }),
             Catch::Contains("run.yaml: cannot be written"));
  const std::string after = read_text(folder / "run.yaml");
  CHECK(after.size() == before.size());
  CHECK_THAT(after, Catch::Contains("\nstate: failed \n"));
  CHECK(YAML::Load(after)["state"].Scalar() == "failed");
}
