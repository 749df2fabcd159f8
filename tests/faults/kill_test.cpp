// SPDX-License-Identifier: MIT
// What is left of a run that is killed, and of the results that it was to replace.
#include <charconv>
#include <chrono>
#include <csignal>
#include <random>
#include <sys/resource.h>

#include "stereo_slam/evaluation/loop_score.hpp"
#include "stereo_slam/evaluation/nees.hpp"
#include "stereo_slam/io/trajectory_io.hpp"
#include "stereo_slam/settings/settings_io.hpp"
#include "stereo_slam/support/program.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

constexpr int kFrames = 4000;

std::vector<std::string> run_into(const TemporaryFolder& folder, const std::string& output) {
  return {"run", "--dataset", folder / "in", "--output", folder / output, "--overwrite"};
}

/// The frames that the program said it had finished.
std::size_t frames_reported(const std::string& out) {
  const auto begin = out.rfind("frame ");
  std::size_t frames = 0;
  if (begin != std::string::npos) std::from_chars(out.data() + begin + 6, out.data() + out.size(), frames);
  return frames;
}

/// Every file can be read, and holds all finished frames. Returns how many.
std::size_t check_killed_run(const fs::path& output, std::size_t finished) {
  if (!fs::exists(output / "run.yaml")) {
    CHECK(finished == 0);  // killed before it began
    return 0;
  }
  CHECK_THAT(read_text(output / "run.yaml"), Catch::Contains("state: running"));
  CHECK(load_settings(output / "run.yaml").preset == "default");
  const auto poses = split_lines(read_text(output / "trajectory_online.txt")).size();
  CHECK(poses >= finished);
  if (poses > 0) CHECK(read_trajectory(output / "trajectory_online.txt").poses.size() == poses);
  if (!fs::exists(output / "loops.csv")) return poses;
  CHECK(read_covariances(output / "covariances.csv").size() + 1 >= poses);
  CHECK(read_loops(output / "loops.csv").empty());
  CHECK(split_lines(read_text(output / "timing.csv")).size() + 1 >= poses);
  return poses;
}

/// Time from the start of a run to its first frame.
std::int64_t first_frame_us(const TemporaryFolder& folder) {
  const auto start = std::chrono::steady_clock::now();
  const Program program(folder.path(), run_into(folder, "first"));
  program.wait_for_output("frame 1/");
  const auto time = std::chrono::steady_clock::now() - start;
  program.signal(SIGKILL);
  (void)program.wait();
  return std::chrono::duration_cast<std::chrono::microseconds>(time).count();
}

}  // namespace

TEST_CASE("Every frame that a run finished before it was killed is in its files", "[faults]") {
  const TemporaryFolder folder;
  write_long_sequence(folder / "in", kFrames);
  // Killed before the first frame and after it, however slow the machine is.
  const auto longest_us = static_cast<unsigned>(3 * first_frame_us(folder));
  std::mt19937 random(20);
  std::size_t most = 0;
  for (int i = 0; i < 20; ++i) {
    const auto output = fmt::format("out{}", i % 4);  // fresh ones, then those of killed runs
    const bool replaces = fs::exists(folder / output / "run.yaml");
    const Program program(folder.path(), run_into(folder, output));
    usleep(std::uniform_int_distribution<unsigned>(1'000, longest_us)(random));
    program.signal(SIGKILL);
    const auto result = program.wait();
    CHECK(result.status == 1000 + SIGKILL);
    const fs::path results = replaces ? folder / output / "unfinished" : folder / output;
    most = std::max(most, check_killed_run(results, frames_reported(result.out)));
  }
  CHECK(most > 0);
}

TEST_CASE("A killed run leaves the results that it was to replace", "[faults]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "short", 3);
  CHECK(call({"run", "--dataset", folder / "short", "--output", folder / "out", "--quiet"}).status == 0);
  const auto before = read_text(folder / "out/trajectory_kitti.txt");
  write_long_sequence(folder / "in", kFrames);
  const Program program(folder.path(), run_into(folder, "out"));
  program.wait_for_output("frame 50/");
  program.signal(SIGKILL);
  const auto result = program.wait();
  CHECK(read_text(folder / "out/trajectory_kitti.txt") == before);
  CHECK_THAT(read_text(folder / "out/run.yaml"), Catch::Contains("state: finished"));
  CHECK(check_killed_run(folder / "out/unfinished", frames_reported(result.out)) >= 50);

  CHECK(call({"run", "--dataset", folder / "short", "--output", folder / "out", "--quiet", "--overwrite"})
            .status == 0);
  CHECK_FALSE(fs::exists(folder / "out/unfinished"));
}

TEST_CASE("A run that is killed leaves the frames of a run that was killed before", "[faults]") {
  const TemporaryFolder folder;
  write_long_sequence(folder / "in", kFrames);
  const auto kill_at = [&](const char* line) {
    const Program program(folder.path(), run_into(folder, "out"));
    program.wait_for_output(line);
    program.signal(SIGKILL);
    return frames_reported(program.wait().out);
  };
  const auto finished = kill_at("frame 50/");
  (void)kill_at("frame 1/");
  CHECK(check_killed_run(folder / "out", finished) >= 50);
}

TEST_CASE("A run whose folder is moved or removed ends, and writes nothing into another one", "[faults]") {
  const TemporaryFolder folder;
  write_long_sequence(folder / "in", kFrames);
  const Program program(folder.path(), run_into(folder, "out"));
  program.wait_for_output("frame 50/");  // the files are open by then, and none is created any more
  const bool removed = GENERATE(false, true);
  if (removed) {
    fs::remove_all(folder / "out");
  } else {
    fs::rename(folder / "out", folder / "moved");
    fs::create_directories(folder / "out");
  }
  const auto result = program.wait();
  CHECK(result.status == 1);
  CHECK_THAT(result.err,
             Catch::Contains(removed ? "was removed during the run" : "was moved during the run"));
  if (removed) return;
  CHECK(fs::is_empty(folder / "out"));
  CHECK(check_killed_run(folder / "moved", frames_reported(result.out)) >= 50);
}

TEST_CASE("A run whose folder of unfinished results is removed ends at the next frame", "[faults]") {
  const TemporaryFolder folder;
  write_long_sequence(folder / "in", kFrames);
  write_tiny_sequence(folder / "short", 3);
  REQUIRE(call({"run", "--dataset", folder / "short", "--output", folder / "out"}).status == 0);
  const auto earlier = read_text(folder / "out/trajectory_tum.txt");
  const Program program(folder.path(), run_into(folder, "out"));
  program.wait_for_output("frame 50/");
  fs::remove_all(folder / "out/unfinished");
  const auto result = program.wait();
  CHECK(result.status == 1);
  CHECK_THAT(result.err, Catch::Contains("out/unfinished: was removed during the run"));
  CHECK(read_text(folder / "out/trajectory_tum.txt") == earlier);
}

TEST_CASE("Results of an earlier run are replaced with --overwrite only", "[faults]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 3);
  std::vector<std::string> run = {"run", "--dataset", folder / "in", "--output", folder / "out", "--quiet"};
  CHECK(call(run).status == 0);
  check_one_line_failure(call(run), "replace them with --overwrite");
  run.emplace_back("--overwrite");
  CHECK(call(run).status == 0);
}

TEST_CASE("A run that fails before its first frame leaves the results that it was to replace", "[faults]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 3);
  CHECK(call({"run", "--dataset", folder / "in", "--output", folder / "out", "--quiet"}).status == 0);
  fs::remove(folder / "in/image_1/000000.png");
  check_one_line_failure(call(run_into(folder, "out")), "000000.png: missing");
  CHECK(split_lines(read_text(folder / "out/trajectory_kitti.txt")).size() == 3);
}

TEST_CASE("Earlier results and an earlier map are replaced only by a run that finishes", "[faults]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 8);
  write_tiny_sequence(folder / "broken", 8);
  truncate_file(folder / "broken/image_1/000002.png", 0.5);
  write_tiny_sequence(folder / "same", 8);
  for (int i = 0; i < 8; ++i) {
    fs::copy_file(folder / "same/image_0" / frame_name(i), folder / "same/image_1" / frame_name(i),
                  fs::copy_options::overwrite_existing);
  }
  const auto run = [&](const std::string& input) {
    return call({"run", "--dataset", folder / input, "--output", folder / "out", "--save-map",
                 folder / "street.map", "--json", folder / "run.json", "--overwrite", "--quiet", "--strict"});
  };
  REQUIRE(run("in").status == 0);
  const auto poses = read_text(folder / "out/trajectory_kitti.txt");
  const auto map = read_text(folder / "street.map");
  const std::string out = folder / "out", unfinished = folder / "out/unfinished";
  const std::string first_map = folder / "street.map", second_map = folder / "street-2.map";
  const std::string kept = "in " + unfinished + "; " + out + " has the results of the earlier run";
  const auto check_kept = [&](std::size_t frames) {
    CHECK(read_text(folder / "out/trajectory_kitti.txt") == poses);
    CHECK(read_text(folder / "street.map") == map);
    CHECK_THAT(read_text(folder / "out/run.yaml"), Catch::Contains("state: finished"));
    CHECK(split_lines(read_text(folder / "out/unfinished/trajectory_kitti.txt")).size() == frames);
    CHECK_THAT(read_text(folder / "out/unfinished/run.yaml"),
               Catch::Contains("state: failed") && Catch::Contains("error: "));
    CHECK_THAT(read_text(folder / "run.json"),
               Catch::Contains("\"state\": \"failed\"") && Catch::Contains("\"output\": \"" + unfinished));
  };
  const auto broken = run("broken");
  check_one_line_failure(broken, "(the 2 frames before it are " + kept);
  CHECK_THAT(broken.err,
             Catch::Contains("; the map is in " + second_map + ", " + first_map + " is the earlier one)"));
  CHECK(fs::exists(second_map));
  check_kept(2);
  const auto limit_files = [] {
    constexpr rlimit kBytes = {1'000, 1'000};  // less than run.yaml has
    setrlimit(RLIMIT_FSIZE, &kBytes);
  };
  check_one_line_failure(
      call(run_into(folder, "out"), limit_files),
      "(it ended the run before its first frame; " + out + " has the results of the earlier run)");
  check_kept(2);  // those of the run before
  const auto same = run("same");
  check_one_line_failure(same, "of 8 frames: hardly any corner");
  CHECK_THAT(same.err, Catch::Contains("(the results are " + kept));
  check_kept(8);
  CHECK(run("in").status == 0);
  CHECK_FALSE(fs::exists(folder / "out/unfinished"));
}

TEST_CASE("Ctrl-C leaves the results that the run was to replace, and says where its own are", "[faults]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "short", 3);
  CHECK(call({"run", "--dataset", folder / "short", "--output", folder / "out", "--quiet"}).status == 0);
  write_long_sequence(folder / "in", kFrames);
  const Program program(folder.path(), run_into(folder, "out"));
  program.wait_for_output("frame 50/");
  program.signal(SIGINT);
  const auto result = program.wait();
  CHECK(result.status == 130);
  const std::string out = folder / "out";
  CHECK_THAT(result.out, Catch::Contains("results in " + out + "/unfinished; " + out +
                                         " has the results of the earlier run\n"));
  CHECK(split_lines(read_text(folder / "out/trajectory_kitti.txt")).size() == 3);
  CHECK(split_lines(read_text(folder / "out/unfinished/trajectory_kitti.txt")).size() >= 50);
  CHECK_THAT(read_text(folder / "out/unfinished/run.yaml"), Catch::Contains("state: interrupted"));
}

TEST_CASE("Two runs cannot write to one folder; the lock of a killed run is gone", "[faults]") {
  const TemporaryFolder folder;
  write_long_sequence(folder / "in", kFrames);
  const Program program(folder.path(), run_into(folder, "out"));
  program.wait_for_output("frame 1/");
  check_one_line_failure(call(run_into(folder, "out")), "another run is writing to it");
  program.signal(SIGKILL);
  (void)program.wait();
  auto again = run_into(folder, "out");
  again.insert(again.end(), {"--max-frames", "2", "--quiet"});
  CHECK(call(again).status == 0);
}

TEST_CASE("A full disk ends the run with one line; the frames before it are whole", "[faults]") {
  const TemporaryFolder folder;
  write_long_sequence(folder / "in", kFrames);
  const auto limit_files = [] {
    constexpr rlimit kBytes = {40'000, 40'000};
    setrlimit(RLIMIT_FSIZE, &kBytes);
  };
  const auto result = call(run_into(folder, "out"), limit_files);
  check_one_line_failure(result, "cannot be written (File too large)");
  CHECK_THAT(read_text(folder / "out/run.yaml"), Catch::Contains("state: failed"));
  const auto poses = read_trajectory(folder / "out/trajectory_online.txt").poses.size();
  CHECK(poses > 10);
  CHECK(read_covariances(folder / "out/covariances.csv").size() + 1 >= poses);
}
