// SPDX-License-Identifier: MIT
#include "stereo_slam/ros2_output/mcap_recording.hpp"

#include "stereo_slam/app/runner.hpp"
#include "stereo_slam/bags/message_file.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

[[nodiscard]] MapPoint landmark(std::uint32_t id, double x) {
  return {.position_world = {x, 0.0, 0.0}, .intensity = 0, .keyframe = 0, .landmark = id};
}

}  // namespace

TEST_CASE("Every landmark is new once, also when a loop moves and unites them", "[mcap]") {
  NewLandmarks landmarks;
  CHECK(landmarks.take({}, false).empty());
  std::vector<MapPoint> points = {landmark(1, 1.0), landmark(7, 7.0)};
  CHECK(landmarks.take(points, false).size() == 2);
  points.push_back(landmark(9, 9.0));
  const auto one = landmarks.take(points, false);
  REQUIRE(one.size() == 1);
  CHECK(one[0].x() == 9.0F);
  const auto after_loop = landmarks.take({landmark(7, 7.1), landmark(1, 1.1), landmark(8, 8.0)}, true);
  REQUIRE(after_loop.size() == 1);
  CHECK(after_loop[0].x() == 8.0F);
  CHECK(landmarks.take({landmark(0, 1.0), landmark(0, 2.0)}, true).size() == 2);  // without an id
}

TEST_CASE("What takes time in proportion to the run is done ever more rarely", "[mcap]") {
  GrowingInterval interval;
  std::size_t sum = 0;
  constexpr std::size_t kFrames = 10'000;
  for (std::size_t frames = 1; frames <= kFrames; ++frames) {
    if (!interval.is_due(frames)) continue;
    interval.done(frames);
    sum += frames;
  }
  CHECK(sum < 12 * kFrames);
  CHECK(sum > 8 * kFrames);
}

TEST_CASE("A run with --mcap has the same results, and a message of every frame", "[mcap]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 8);
  const auto sequence = open_sequence(folder / "in", "auto");
  RunOptions options{
      .output = folder / "out", .max_frames = std::nullopt, .threads = std::nullopt, .quiet = true};
  CHECK(run(sequence, Settings{}, options).error.empty());
  options.output = folder / "out2";
  options.mcap = folder / "run.mcap";
  options.mcap_images = GENERATE(false, true);
  const auto summary = run(sequence, Settings{}, options);
  CHECK(summary.error.empty());
  CHECK_FALSE(summary.mcap);
  for (const auto* name : {"trajectory_kitti.txt", "trajectory_online.txt", "covariances.csv", "map.ply"})
    CHECK(read_text(folder / "out" / name) == read_text(folder / "out2" / name));

  const auto file = open_message_file(folder / "run.mcap");
  CHECK(file->places("/stereo_slam/odometry").size() == 8);
  CHECK(file->places("/stereo_slam/map").size() == 1);
  CHECK(file->places("/stereo_slam/left/compressed").size() == (options.mcap_images ? 8 : 0));
  REQUIRE(file->times());
  CHECK(file->times()->first_ns == sequence.frames.front().stamp_ns);
  CHECK(file->times()->last_ns == sequence.frames.back().stamp_ns);
  CHECK(file->warning().empty());
}

TEST_CASE("A run without frames leaves no file of messages", "[mcap]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 2);
  const auto sequence = open_sequence(folder / "in", "auto");
  McapRecording recording({.file = folder / "run.mcap"}, sequence);
  CHECK(fs::exists(folder / "run.mcap"));
  recording.finish({});
  CHECK_FALSE(fs::exists(folder / "run.mcap"));
}

TEST_CASE("Stamps that ROS 2 does not have leave all results but the messages", "[mcap]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 8);
  auto sequence = open_sequence(folder / "in", "auto");
  for (auto& frame : sequence.frames) frame.stamp_ns += 3'000'000'000'000'000'000;
  RunOptions options{
      .output = folder / "out", .max_frames = std::nullopt, .threads = std::nullopt, .quiet = true};
  options.mcap = folder / "run.mcap";
  const auto summary = run(sequence, Settings{}, options);
  CHECK_THAT(summary.error, Catch::StartsWith((folder / "run.mcap").string()) &&
                                Catch::Contains("the stamp 3e+09 s is none of ROS 2"));
  CHECK(summary.frames == 8);
  CHECK(split_lines(read_text(folder / "out/trajectory_kitti.txt")).size() == 8);
}
