// SPDX-License-Identifier: MIT
// Runs at the pace of the recording's stamps.
#include <chrono>
#include <utility>

#include <yaml-cpp/yaml.h>

#include "stereo_slam/app/runner.hpp"
#include "stereo_slam/io/text_file.hpp"
#include "stereo_slam/io/trajectory_io.hpp"
#include "stereo_slam/report/page_data.hpp"
#include "stereo_slam/settings/settings_io.hpp"
#include "stereo_slam/support/support.hpp"
#include "stereo_slam/support/tiny_video.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

/// The rows of timing.csv, and the frames dropped according to its last column.
std::pair<std::size_t, std::size_t> processed_and_dropped(const fs::path& output) {
  const auto lines = split_lines(read_text(output / "timing.csv"));
  std::size_t dropped = 0;
  for (std::size_t i = 1; i < lines.size(); ++i)
    dropped += std::stoul(lines[i].substr(lines[i].rfind(',') + 1));
  return {lines.size() - 1, dropped};
}

RunSummary run_in_real_time(const StereoSequence& sequence, const fs::path& output) {
  return run(sequence, Settings{},
             {.output = output,
              .max_frames = std::nullopt,
              .threads = std::nullopt,
              .quiet = true,
              .realtime = true});
}

/// The recording with stamps that are `period` apart.
StereoSequence at_pace(StereoSequence sequence, std::chrono::nanoseconds period) {
  for (std::size_t i = 0; i < sequence.frames.size(); ++i)
    sequence.frames[i].stamp_ns = static_cast<std::int64_t>(i) * period.count();
  return sequence;
}

}  // namespace

TEST_CASE("A run in real time takes as long as the recording, and drops no frame that it has time for",
          "[runner]") {
  using namespace std::chrono_literals;
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 4);
  const auto sequence = at_pace(open_sequence(folder / "in", "auto"), 400ms);
  const auto summary = run_in_real_time(sequence, folder / "out");
  CHECK(summary.error.empty());
  CHECK(summary.frames == 4);
  CHECK(summary.seconds >= 1.2);
  REQUIRE(summary.realtime);
  CHECK(summary.realtime->dropped == 0);
  CHECK(summary.realtime->max_ms >= summary.frame_cost.max_ms);
  (void)run(sequence, Settings{},
            {.output = folder / "plain", .max_frames = std::nullopt, .threads = std::nullopt, .quiet = true});
  for (const auto* name : {"trajectory_kitti.txt", "trajectory_tum.txt", "covariances.csv"})
    CHECK(read_text(folder / "out" / name) == read_text(folder / "plain" / name));
}

TEST_CASE("A run in real time drops the frames that it has no time for, and says how many", "[runner]") {
  using namespace std::chrono_literals;
  const TemporaryFolder folder;
  constexpr std::size_t kFrames = 30;
  write_tiny_sequence(folder / "in", kFrames);
  const fs::path out = folder / "out";
  const auto summary = run_in_real_time(at_pace(open_sequence(folder / "in", "auto"), 1us), out);
  CHECK(summary.error.empty());
  REQUIRE(summary.realtime);
  CHECK(summary.realtime->dropped > 0);
  CHECK(summary.frames + summary.realtime->dropped == kFrames);
  CHECK(processed_and_dropped(out) == std::pair{summary.frames, summary.realtime->dropped});
  CHECK(read_trajectory(out / "trajectory_kitti.txt").poses.size() == kFrames);
  CHECK(read_trajectory(out / "trajectory_tum.txt").poses.size() == summary.frames);
  CHECK(split_lines(read_text(out / "covariances.csv")).size() == summary.frames + 1);
  const auto yaml = YAML::LoadFile((out / "run.yaml").string());
  CHECK(yaml["frames_processed"].as<std::size_t>() == summary.frames);
  CHECK(yaml["realtime"]["frames_dropped"].as<std::size_t>() == summary.realtime->dropped);
  CHECK(yaml["realtime"]["latency_max_ms"].as<double>() == Approx(summary.realtime->max_ms).margin(1e-3));
  CHECK(yaml["realtime"]["reading_delay_s"].as<double>() > 0.0);
  CHECK(load_settings(out / "run.yaml").preset == "default");
  CHECK(page_data(read_text(out / "report.html"))["frame_count"] == summary.frames);
}

TEST_CASE("A video can be run in real time, also one that ends before its header says", "[runner]") {
  const TemporaryFolder folder;
  write_tiny_video(folder.path(), 6, 6);
  auto sequence = open_with_false_header(folder.path(), 7);
  sequence.frames.back().stamp_ns += 100'000'000;
  const auto summary = run_in_real_time(sequence, folder / "out");
  CHECK(summary.error.empty());
  REQUIRE(summary.realtime);
  CHECK(summary.frames + summary.realtime->dropped == 6);
}

TEST_CASE("Without stamps that increase, a run in real time is refused before it begins", "[runner]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 3);
  auto sequence = open_sequence(folder / "in", "auto");
  for (auto& frame : sequence.frames) frame.stamp_ns = 0;
  CHECK_THAT(message_of([&] { (void)run_in_real_time(sequence, folder / "out"); }),
             Catch::Contains("frame 1 has no later stamp") && Catch::Contains("leave out --realtime"));
  CHECK_FALSE(fs::exists(folder / "out"));
}
