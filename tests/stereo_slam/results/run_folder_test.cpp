// SPDX-License-Identifier: MIT
#include "stereo_slam/results/run_folder.hpp"

#include "stereo_slam/results/output.hpp"
#include "stereo_slam/results/result_streams.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

/// What a run leaves: its files, each with `text`, and a run.yaml with `state`.
void leave_run(const fs::path& folder, const std::string& state, const std::string& text) {
  fs::create_directories(folder);
  for (const auto* name : result_files()) write_text(folder / name, text);
  write_text(folder / "run.yaml", "version: 1.0.0\nstate: " + state + "\n");
}

/// A record of one more frame.
void add_frame(RunRecord& record, const std::string& stage) {
  FrameResult result;
  result.index = record.results.size();
  result.stamp_ns = static_cast<std::int64_t>(result.index) * 100'000'000;
  result.times = {{stage, 1.0}};
  record.results.push_back(result);
  record.total_ms.push_back(2.0);
  record.cpu_ms.push_back(2.0);
  record.read_cpu_ms.push_back(1.0);
  record.resident_mb.push_back(3.0);
}

}  // namespace

TEST_CASE("An output folder is created, and a run writes into it", "[run_folder]") {
  const TemporaryFolder folder;
  write_text(folder / "mine.txt", "keep");
  const RunFolder run(folder / "a/b", false);
  CHECK(run.working() == folder / "a/b");
  run.publish();
  const RunFolder beside(folder.path(), false);  // other files do not matter
  CHECK(beside.working() == folder.path());
  CHECK_THAT(message_of([&] { const RunFolder file(folder / "mine.txt", true); }),
             Catch::Contains("choose another --output"));
  CHECK_THAT(message_of([] { const RunFolder nameless("", true); }), Catch::Contains("--output is empty"));
}

TEST_CASE("Two runs cannot write to one folder", "[run_folder]") {
  const TemporaryFolder folder;
  {
    const RunFolder first(folder.path(), false);
    CHECK_THAT(message_of([&] { const RunFolder second(folder.path(), true); }),
               Catch::Contains("another run is writing to it"));
  }
  CHECK(message_of([&] { const RunFolder third(folder.path(), false); }).empty());
}

TEST_CASE("Results of an earlier run stay until a run with overwrite replaces them", "[run_folder]") {
  const TemporaryFolder folder;
  leave_run(folder.path(), GENERATE("finished", "interrupted", "failed"), "old");
  CHECK_THAT(message_of([&] { const RunFolder run(folder.path(), false); }),
             Catch::Contains("replace them with --overwrite"));

  const RunFolder run(folder.path(), true);
  CHECK(run.working() == folder / "unfinished");
  leave_run(run.working(), "finished", "new");
  fs::remove(run.working() / "report.html");
  CHECK(read_text(folder / "map.ply") == "old");
  run.publish();
  CHECK(read_text(folder / "map.ply") == "new");
  CHECK_FALSE(fs::exists(folder / "report.html"));  // of another run
  CHECK(fs::exists(folder / "run.yaml"));
  CHECK_FALSE(fs::exists(folder / "unfinished"));
}

TEST_CASE("A run that was killed while it replaced results is completed by the next one", "[run_folder]") {
  const TemporaryFolder folder;
  leave_run(folder.path(), "finished", "old");
  {
    const RunFolder run(folder.path(), true);
    leave_run(run.working(), "finished", "new");
    // As far as publish() came: without the earlier run.yaml, and with some of the results in place.
    fs::remove(folder / "run.yaml");
    fs::rename(run.working() / "timing.csv", folder / "timing.csv");
    write_text(run.working() / "run.yaml.partial-12-0", "");
  }
  const bool overwrite = GENERATE(false, true);
  if (overwrite) {
    const RunFolder next(folder.path(), true);
    CHECK(next.working() == folder / "unfinished");
    CHECK(fs::is_empty(next.working()));
  } else {
    CHECK_THAT(message_of([&] { const RunFolder next(folder.path(), false); }),
               Catch::Contains("replace them with --overwrite"));
    CHECK_FALSE(fs::exists(folder / "unfinished"));
  }
  for (const auto* name : result_files()) CHECK(read_text(folder / name) == "new");
  CHECK(fs::exists(folder / "run.yaml"));
}

TEST_CASE("Results that did not finish never take the place of earlier ones, even without run.yaml",
          "[run_folder]") {
  const TemporaryFolder folder;
  leave_run(folder / "unfinished", GENERATE("failed", "interrupted", "running"), "new");
  const RunFolder next(folder.path(), true);
  CHECK(next.working() == folder.path());
  CHECK(read_text(folder / "unfinished/map.ply") == "new");
}

TEST_CASE("Other output of a run has a place besides its results", "[run_folder]") {
  const TemporaryFolder folder;
  const fs::path out = folder / "out";
  CHECK(message_of([&] { require_writable_besides_results(out / "summary.json", out); }).empty());
  CHECK(message_of([&] { require_writable_besides_results(folder / "map.ply", out); }).empty());
  for (const auto* name : {"report.html", "run.yaml", "trajectory_tum.txt", "../out/map.ply"}) {
    CAPTURE(name);
    CHECK_THAT(message_of([&] { require_writable_besides_results(out / name, out); }),
               Catch::Contains("is the name of a result file in --output"));
  }
  CHECK_THAT(message_of([&] { require_writable_besides_results(folder / "none/summary.json", out); }),
             Catch::Contains("cannot be written"));
}

TEST_CASE("The frames of a killed run stay until a run with overwrite has finished", "[run_folder]") {
  const TemporaryFolder folder;
  leave_run(folder.path(), "running", "old");
  const RunFolder run(folder.path(), true);
  CHECK(run.working() == folder / "unfinished");
  leave_run(run.working(), "finished", "new");
  CHECK(read_text(folder / "trajectory_online.txt") == "old");
  run.publish();
  CHECK(read_text(folder / "trajectory_online.txt") == "new");
}

TEST_CASE("The frames of a run killed in unfinished/ stay until the first frame of the next",
          "[run_folder]") {
  const TemporaryFolder folder;
  leave_run(folder.path(), "finished", "old");
  fs::create_directories(folder / "unfinished");
  leave_run(folder / "unfinished", "running", "killed");
  const RunFolder run(folder.path(), true);
  ResultStreams streams(run.working(), std::nullopt);
  CHECK_FALSE(streams.begun());
  CHECK(read_text(run.working() / "trajectory_online.txt") == "killed");
  RunRecord record;
  add_frame(record, "odometry");
  streams.append_frame(record);
  CHECK(split_lines(read_text(run.working() / "trajectory_online.txt")).size() == 1);
  CHECK_FALSE(fs::exists(run.working() / "trajectory_kitti.txt"));
}

TEST_CASE("Names of results that belong to something else are refused, with overwrite too", "[run_folder]") {
  const TemporaryFolder folder;
  const auto refusal = [&] { return message_of([&] { const RunFolder run(folder.path(), true); }); };
  SECTION("A file without the run.yaml of a run") {
    write_text(folder / "map.ply", "mine");
    CHECK_THAT(refusal(), Catch::Contains("map.ply: exists, and no run wrote it"));
    CHECK(read_text(folder / "map.ply") == "mine");
  }
  SECTION("A run.yaml of another program") {
    write_text(folder / "run.yaml", "distance: 10 km\n");
    CHECK_THAT(refusal(), Catch::Contains("run.yaml: is not of a run"));
  }
  SECTION("A folder") {
    leave_run(folder.path(), "finished", "old");
    fs::remove(folder / "map.ply");
    fs::create_directories(folder / "map.ply");
    CHECK_THAT(refusal(), Catch::Contains("map.ply: is a folder"));
    CHECK(read_text(folder / "loops.csv") == "old");
  }
  SECTION("A symbolic link") {
    leave_run(folder.path(), "finished", "old");
    fs::remove(folder / "loops.csv");
    write_text(folder / "mine.txt", "mine");
    fs::create_symlink(folder / "mine.txt", folder / "loops.csv");
    CHECK_THAT(refusal(), Catch::Contains("loops.csv: is not an ordinary file"));
    CHECK(read_text(folder / "mine.txt") == "mine");
  }
}

TEST_CASE("Every appended frame and loop is in its file at once", "[run_folder]") {
  const TemporaryFolder folder;
  ResultStreams streams(folder.path(), std::nullopt);
  CHECK(streams.begun());
  RunRecord record;
  const auto lines = [&](const char* name) { return split_lines(read_text(folder / name)); };
  for (std::size_t frames = 1; frames <= 3; ++frames) {
    add_frame(record, frames < 3 ? "odometry" : "loops");
    streams.append_frame(record);
    record.loops.resize(frames);
    streams.append_loops(record.loops);
    streams.append_loops({});  // the thread of the loops is at work
    streams.sync();
    CHECK(lines("trajectory_online.txt").size() == frames);
    CHECK(lines("covariances.csv").size() == frames + 1);
    CHECK(lines("loops.csv").size() == frames + 1);
    CHECK(lines("timing.csv").size() == frames + 1);
  }
  std::ostringstream timing;
  write_timing(timing, record);
  CHECK(read_text(folder / "timing.csv") == timing.str());  // with the column of a stage that came late
}
