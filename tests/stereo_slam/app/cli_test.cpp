// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include "stereo_slam/support/program.hpp"

using namespace stereo_slam::test;

TEST_CASE("--help and --version have status 0", "[cli]") {
  CHECK_THAT(call({"--help"}).out, Catch::Contains("simulate"));
  CHECK(call({"run", "--help"}).status == 0);
  CHECK(call({"--version"}).status == 0);
}

TEST_CASE("Wrong usage has status 2", "[cli]") {
  const std::vector<std::vector<std::string>> wrong = {
      {},
      {"fly"},
      {"run"},
      {"run", "--dataset", "x"},
      {"run", "--dataset", "x", "--output", "y", "--preset", "none"},
      {"run", "--dataset", "x", "--output", "y", "--threads", "0"},
      {"run", "--dataset", "x", "--output", "y", "--max-frames", "-3"},
      {"info"},
      {"info", "--dataset", "x", "--format", "rosbag"},
      {"evaluate", "--groundtruth", "x"},
      {"evaluate", "--groundtruth", "x", "--estimate", "y", "--format", "csv"},
      {"evaluate", "--groundtruth", "x", "--estimate", "y", "--max-time-difference", "nan"},
      {"evaluate", "--groundtruth", "x", "--estimate", "y", "--covariances", "c", "--truth-sigma-m", "-1"},
      {"evaluate", "--groundtruth", "x", "--estimate", "y", "--loops", "l", "--min-gap-frames", "0"},
      {"compare", "--output", "x.html"},
      {"compare", "x"},
      {"compare", "x", "--output", "y.html", "--groundtruth", "t", "--max-time-difference", "nan"},
      {"simulate"},
      {"simulate", "--output", "x", "--frames", "many"},
      {"simulate", "--output", "x", "--scene", "bogus"},
      {"simulate", "--output", "x", "--distortion", "radtan"},
      {"--print-settings", "paper", "info", "--dataset", "x"},
      {"run", "--dataset", "x", "--output", "y", "--pose-frame", "world"},
      {"info", "--dataset", "x", "--bogus"}};
  for (const auto& arguments : wrong) {
    CAPTURE(arguments);
    const auto result = call(arguments);
    CHECK(result.status == 2);
    CHECK_FALSE(result.err.empty());
  }
}

TEST_CASE("A missing name and a value that an option does not have are named", "[cli]") {
  const std::vector<std::pair<std::vector<std::string>, const char*>> cases = {
      {{"run", "--dataset", "x", "--output", "--quiet"}, "--output: a name is missing before --quiet"},
      {{"run", "--dataset", "x", "--output", "y", "--pose-frame", "x"},
       "--pose-frame: x is not one of body, camera"},
      {{"run", "--dataset", "x", "--output", "y", "--pose-frame", "1"},
       "--pose-frame: 1 is not one of body, camera"},
      {{"info", "--dataset", "x", "--format", "rosbag"},
       "--format: rosbag is not one of kitti, euroc, folders, video, auto"},
      {{"info", "--dataset", "x", "--right-image-offset", "1.5"},
       "--right-image-offset: 1.5 is not a whole number from -1000 to 1000"},
      {{"info", "--dataset", "x", "--right-image-offset", "-1001"},
       "--right-image-offset: -1001 is not a whole number from -1000 to 1000"},
      {{"simulate", "--output", "x", "--rig-vibration", "-1"},
       "--rig-vibration: -1 is not a number from 0 to 20"},
      {{"simulate", "--output", "x", "--rig-vibration", "1,nan"},
       "--rig-vibration: nan is not a number from 0 to"},
      {{"simulate", "--output", "x", "--lens-error", "-.026"}, "--lens-error: -.026 is not 2 numbers"},
      {{"simulate", "--output", "x", "--imu", "--imu-noise", "1e-3"}, "--imu-noise: 1e-3 is not 2 numbers"},
      {{"simulate", "--output", "x", "--imu", "--imu-range", "10,0"}, "--imu-range"},
      {{"simulate", "--output", "x", "--imu-delay", "3"}, "--imu-delay requires --imu"},
      {{"simulate", "--output", "x", "--lens-error", "-1,0"},
       "--lens-error: a lens_error of -1.000000, 0.000000 folds"},
      {{"simulate", "--output", "x", "--lens-error", "1e9,0"},
       "--lens-error: 1e9 is not a number from -1 to 1"},
      {{"simulate", "--output", "x", "--format", "euroc", "--lens-error", "-.026,.013"},
       "--lens-error: needs --format kitti"},
      {{"simulate", "--output", "x", "--rig-drift", "nan"},
       "--rig-drift: nan is not a number from -20 to 20"},
      {{"simulate", "--output", "x", "--ride", "-17"}, "--ride: -17 is not a number from 0 to 200"},
      {{"simulate", "--output", "x", "--sync-error", "1e9"},
       "--sync-error: 1e9 is not a number from -1000 to 1000"},
      {{"simulate", "--output", "x", "--rig-vibration", "1,2,3"},
       "--rig-vibration: 1,2,3 is not 1 to 2 numbers"},
      {{"simulate", "--output", "x", "--exposure", "200"},
       "--exposure: is longer than the time between two frames"}};
  for (const auto& [arguments, message] : cases) {
    CAPTURE(arguments);
    const auto result = call(arguments);
    CHECK(result.status == 2);
    CHECK(split_lines(result.err).size() == 1);
    CHECK_THAT(result.err, Catch::StartsWith(std::string("stereo_slam: ") + message));
  }
}

TEST_CASE("An option that has no effect without another one is wrong usage", "[cli]") {
  const std::vector<std::string> evaluate = {"evaluate", "--groundtruth", "x", "--estimate", "y"};
  const std::vector<std::string> info = {"info", "--dataset", "x"};
  const std::vector<std::string> compare = {"compare", "x", "--output", "y.html"};
  struct Case {
    std::vector<std::string> command;
    std::string option, value, needed;
  };
  const std::vector<Case> cases = {{evaluate, "--truth-sigma-m", "0.03", "--covariances"},
                                   {evaluate, "--truth-sigma-deg", "0.1", "--covariances"},
                                   {evaluate, "--min-gap-frames", "50", "--loops"},
                                   {info, "--pose-frame", "body", "--write-groundtruth"},
                                   {info, "--left-topic", "/left", "--right-topic"},
                                   {info, "--right-topic", "/right", "--left-topic"},
                                   {compare, "--max-time-difference", "0.1", "--groundtruth"}};
  for (auto [command, option, value, needed] : cases) {
    CAPTURE(option);
    command.insert(command.end(), {option, value});
    const auto result = call(command);
    CHECK(result.status == 2);
    CHECK(split_lines(result.err).size() == 1);
    CHECK_THAT(result.err, Catch::StartsWith(fmt::format("stereo_slam: {} requires {}", option, needed)));
  }
}

TEST_CASE("compare writes one page about several runs, and refuses folders that are none", "[cli]") {
  const TemporaryFolder folder;
  const std::string in = folder / "in", page = folder / "compare.html";
  write_tiny_sequence(in, 4);
  for (const auto* name : {"default", "odometry"})
    REQUIRE(call({"run", "--dataset", in, "--preset", name, "--output", folder / name, "--quiet"}).status ==
            0);
  const auto result = call({"compare", folder / "default", folder / "odometry", "--output", page});
  CHECK(result.status == 0);
  CHECK(result.err.empty());
  CHECK_THAT(result.out, Catch::Contains("2 runs compared in " + page));
  CHECK_THAT(read_text(page),
             Catch::Contains("\"Comparison of 2 runs\"") && Catch::Contains("loop_closure.enabled"));
  const auto refused = call({"compare", in, "--output", page});
  CHECK(refused.status == 1);
  CHECK_THAT(refused.err, Catch::Contains("in/run.yaml: not found"));
}

TEST_CASE("Printed settings are a settings file", "[cli]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 2);
  const auto printed = call({"--print-settings", "paper"});
  CHECK(printed.status == 0);
  write_text(folder / "s.yaml", printed.out);
  const auto run =
      call({"run", "--dataset", folder / "in", "--output", folder / "out", "--config", folder / "s.yaml"});
  CHECK(run.err.empty());
  CHECK(run.status == 0);
  CHECK_THAT(read_text(folder / "out/run.yaml"), Catch::Contains("preset: paper"));
}
