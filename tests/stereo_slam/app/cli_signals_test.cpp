// SPDX-License-Identifier: MIT
#include <csignal>

#include "stereo_slam/support/program.hpp"

using namespace stereo_slam::test;

TEST_CASE("SIGINT, SIGTERM and SIGHUP end a run with status 130 and all finished frames saved", "[cli]") {
  constexpr int kFrames = 4000;
  const TemporaryFolder folder;
  write_long_sequence(folder / "in", kFrames);
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) {
    fs::remove_all(folder / "out");
    const Program program(folder.path(), {"run", "--dataset", folder / "in", "--output", folder / "out"});
    program.wait_for_output("frame 1/");
    program.signal(number);
    const auto result = program.wait();
    CAPTURE(result.out, result.err);
    CHECK(result.status == 130);
    CHECK(result.err.empty());
    const auto poses = split_lines(read_text(folder / "out/trajectory_kitti.txt")).size();
    CHECK(poses >= 1);
    CHECK(poses < kFrames);
    CHECK(split_lines(read_text(folder / "out/timing.csv")).size() == poses + 1);
    CHECK_THAT(read_text(folder / "out/run.yaml"), Catch::Contains("state: interrupted"));
  }
}

TEST_CASE("A signal that was ignored before the run, as by nohup, does not end it", "[cli]") {
  const TemporaryFolder folder;
  write_long_sequence(folder / "in", 300);
  const Program program(folder.path(),
                        {"run", "--dataset", folder / "in", "--output", folder / "out", "--overwrite"},
                        [] { (void)std::signal(SIGHUP, SIG_IGN); });
  program.wait_for_output("frame 1/");
  program.signal(SIGHUP);
  CHECK(program.wait().status == 0);
  CHECK_THAT(read_text(folder / "out/run.yaml"), Catch::Contains("state: finished"));
}

TEST_CASE("SIGINT ends a rendering with status 130 and a shorter recording", "[cli]") {
  const TemporaryFolder folder;
  const Program program(folder.path(),
                        {"simulate", "--output", folder / "s", "--frames", "2000", "--scale", "0.2"});
  program.wait_for_output("frame 50/");
  program.signal(SIGINT);
  CHECK(program.wait().status == 130);
  const auto info = call({"info", "--dataset", folder / "s"});
  CAPTURE(info.err);
  CHECK(info.status == 0);
}
