// SPDX-License-Identifier: MIT
#include <csignal>
#include <unistd.h>

#include "stereo_slam/support/program.hpp"

using namespace stereo_slam::test;

namespace {

/// Runs the SLAM on a recording with these options in addition. The results are in `folder`/out.
Result run_on(const fs::path& recording, const TemporaryFolder& folder,
              const std::vector<std::string>& options) {
  std::vector<std::string> arguments = {"run",          "--dataset", recording,    "--output",
                                        folder / "out", "--quiet",   "--overwrite"};
  arguments.insert(arguments.end(), options.begin(), options.end());
  return call(arguments);
}

constexpr auto kLoopsHeader = "frame,old_frame,inliers,chi2,verdict,old_map,tx,ty,tz,qx,qy,qz,qw\n";

}  // namespace

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
      {{"simulate", "--output", "x", "--rig-vibration", "-1"},
       "--rig-vibration: -1 is not a number from 0 to 20"},
      {{"simulate", "--output", "x", "--rig-vibration", "1,nan"},
       "--rig-vibration: nan is not a number from 0 to"},
      {{"simulate", "--output", "x", "--lens-error", "-.026"}, "--lens-error: -.026 is not 2 to 2 numbers"},
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
    CHECK_THAT(result.err, Catch::StartsWith("stereo_slam: " + option + " requires " + needed));
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

TEST_CASE("run, evaluate and info work together from the command line", "[cli]") {
  const TemporaryFolder folder;
  const std::string in = folder / "in";
  const std::string out = folder / "out";
  write_tiny_sequence(in, 6);
  const auto info = call({"info", "--dataset", in});
  CHECK(info.status == 0);
  CHECK(info.err.empty());

  const auto run = call({"run", "--dataset", in, "--format", "kitti", "--preset", "default", "--output", out,
                         "--threads", "2", "--no-loop-closure"});
  CHECK(run.status == 0);
  CHECK(run.err.empty());
  CHECK_THAT(run.out,
             Catch::Contains("frame 6/6") && Catch::Contains("6 frames in") && !Catch::Contains("WEAK"));

  for (const auto* estimate : {"/trajectory_kitti.txt", "/trajectory_tum.txt"}) {
    const bool stamped = std::string(estimate).find("tum") != std::string::npos;
    const auto truth = stamped ? out + "/trajectory_online.txt" : in + "/poses.txt";
    const auto evaluate =
        call({"evaluate", "--groundtruth", truth, "--estimate", out + estimate, "--json", folder / "e.json"});
    CAPTURE(evaluate.err);
    CHECK(evaluate.status == 0);
    CHECK_THAT(evaluate.out, Catch::Contains("frames matched                  6"));
    CHECK_THAT(read_text(folder / "e.json"), Catch::Contains("\"frames_matched\": 6"));
  }
  std::vector<std::string> all = {"evaluate",
                                  "--groundtruth",
                                  in + "/poses.txt",
                                  "--estimate",
                                  out + "/trajectory_kitti.txt",
                                  "--covariances",
                                  out + "/covariances.csv",
                                  "--loops",
                                  out + "/loops.csv",
                                  "--json",
                                  folder / "e.json"};
  const auto scored = call(all);
  CHECK(scored.status == 0);
  CHECK_THAT(scored.out, Catch::Contains("revisits                        none"));
  CHECK_THAT(read_text(folder / "e.json"),
             Catch::Contains("\"nees\": {") && Catch::Contains("\"loops\": {\"accepted\": 0"));
  write_text(out + "/loops.csv", std::string(kLoopsHeader) + "5,2,many,1,accepted,run,0,0,0,0,0,0,1\n");
  check_one_line_failure(call(all), "loops.csv:2: expected");
}

TEST_CASE("A quiet run prints nothing", "[cli]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 3);
  const auto run = call({"run", "--dataset", folder / "in", "--output", folder / "out", "--quiet"});
  CHECK(run.status == 0);
  CHECK(run.out.empty());
  CHECK(run.err.empty());
}

TEST_CASE("The command line overrides whether the settings close loops", "[cli]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 2);
  write_text(folder / "off.yaml", "loop_closure: {enabled: false}\n");
  const auto enabled = [&](const std::vector<std::string>& options) {
    CHECK(run_on(folder / "in", folder, options).status == 0);
    const auto yaml = read_text(folder / "out/run.yaml");
    return yaml.find("enabled: true", yaml.find("loop_closure:")) ==
           yaml.find("enabled: ", yaml.find("loop_closure:"));
  };
  CHECK(enabled({}));
  CHECK_FALSE(enabled({"--no-loop-closure"}));
  CHECK_FALSE(enabled({"--config", folder / "off.yaml"}));
  CHECK(enabled({"--config", folder / "off.yaml", "--loop-closure"}));
  CHECK(read_text(folder / "out/loops.csv") == kLoopsHeader);
}

TEST_CASE("--loop-closure is refused before the run if no loop can be closed", "[cli]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 2);
  write_text(folder / "paper.yaml", "preset: paper\n");
  const auto run = [&](const std::vector<std::string>& options) {
    return run_on(folder / "in", folder, options);
  };
  for (const auto& options : std::vector<std::vector<std::string>>{
           {"--preset", "paper", "--loop-closure"}, {"--config", folder / "paper.yaml", "--loop-closure"}}) {
    check_one_line_failure(run(options),
                           "the preset paper has one map without keyframes, and closes no loops");
    CHECK_FALSE(fs::exists(folder / "out"));
  }
  CHECK(run({"--preset", "paper", "--no-loop-closure"}).status == 0);
}

TEST_CASE("A map saved by one run is loaded by the next", "[cli]") {
  const TemporaryFolder folder;
  CHECK(call({"simulate", "--output", folder / "s", "--frames", "5", "--scale", "0.4", "--quiet"}).status ==
        0);
  const auto run = [&](const std::vector<std::string>& options) {
    return run_on(folder / "s", folder, options);
  };
  const std::string file = folder / "streets.map";
  CHECK(run({"--save-map", file}).status == 0);
  CHECK(run({"--load-map", file}).status == 0);
  CHECK(run({"--load-map", file, "--save-map", folder / "longer.map"}).status == 0);
  CHECK(fs::file_size(folder / "longer.map") > fs::file_size(file));

  check_one_line_failure(run({"--load-map", folder / "none.map"}), "none.map");
  const std::string content = read_text(file);
  write_text(folder / "cut.map", content.substr(0, content.size() / 2));
  check_one_line_failure(run({"--load-map", folder / "cut.map"}), "cut.map");
  check_one_line_failure(run({"--load-map", file, "--no-loop-closure"}), "loop closure");
  for (const auto& place : std::vector<std::string>{folder / "nowhere/x.map", folder.path().string(),
                                                    folder / "out", folder / "out/"}) {
    fs::remove_all(folder / "out");
    const auto refused = run({"--save-map", place});
    check_one_line_failure(refused, place);
    CHECK_FALSE(fs::exists(folder / "out"));  // before the first frame
  }
  write_tiny_sequence(folder / "other", 2);
  check_one_line_failure(
      call({"run", "--dataset", folder / "other", "--output", folder / "out", "--load-map", file}),
      "another camera");
}

TEST_CASE("A folder that cannot take debug images gives one line and status 1", "[cli]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 2);
  write_text(folder / "file", "");
  check_one_line_failure(call({"run", "--dataset", folder / "in", "--output", folder / "out",
                               "--debug-images", folder / "file"}),
                         "choose another folder");
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

TEST_CASE("Broken input gives one line and status 1, from run and from info", "[cli]") {
  const auto rename_images = [](const fs::path& f) {
    fs::rename(f / "image_0", f / "x");
    fs::rename(f / "image_1", f / "image_0");
    fs::rename(f / "x", f / "image_1");
  };
  const std::vector<Breaking> cases = {
      {"no such folder", [](const fs::path& f) { fs::remove_all(f); }},
      {"calib.txt: missing", [](const fs::path& f) { fs::remove(f / "calib.txt"); }},
      {"baseline of zero",
       [](const fs::path& f) {
         write_text(f / "calib.txt", projection_line("P0", 0) + projection_line("P1", 0));
       }},
      {"look swapped", rename_images},
      {"image_1/000002.png: missing", [](const fs::path& f) { fs::remove(f / "image_1/000002.png"); }},
      {"image_0/000002.png: the PNG is truncated",
       [](const fs::path& f) { truncate_file(f / "image_0/000002.png", 0.6); }},
      {"000003.png: is 200x120",
       [](const fs::path& f) { cv::imwrite((f / "image_0/000003.png").string(), tiny_texture(200)); }},
      {"times.txt:3: 'noon' is not",
       [](const fs::path& f) { write_text(f / "times.txt", "0\n1\nnoon\n3\n4\n"); }},
      {"has 3 times for 5 images", [](const fs::path& f) { write_text(f / "times.txt", "0\n1\n2\n"); }},
      {"is empty",
       [](const fs::path& f) { fs::remove_all(f / "image_0"), fs::create_directory(f / "image_0"); }},
      {"single frame", [](const fs::path& f) { fs::remove_all(f), write_tiny_sequence(f, 1); }},
  };
  check_refused(write_tiny_sequence, cases);
}

TEST_CASE("With --strict a run fails at an image that cannot be read, and saves the frames before it",
          "[cli]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 5);
  truncate_file(folder / "in/image_1/000003.png", 0.5);
  const std::vector<std::string> run = {"run",      "--dataset",    folder / "in",
                                        "--output", folder / "out", "--strict"};
  check_one_line_failure(call(run), "(the 3 frames before it are saved)");
  CHECK(split_lines(read_text(folder / "out/trajectory_kitti.txt")).size() == 3);
}

TEST_CASE("Without --strict a warning counts the images that cannot be read, and names the first", "[cli]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 8);
  truncate_file(folder / "in/image_1/000003.png", 0.5);
  write_text(folder / "in/image_0/000005.png", "");
  const std::vector<std::string> arguments = {"run",          "--dataset", folder / "in",      "--output",
                                              folder / "out", "--json",    folder / "run.json"};
  const auto run = call(arguments);
  CHECK(run.status == 0);
  CHECK_THAT(run.err,
             Catch::Contains("warning: 2 of the images of 8 frames could not be read, and were treated as "
                             "missing (run.yaml names them); the first: ") &&
                 Catch::Contains("image_1/000003.png: the PNG is truncated"));
  CHECK_THAT(read_text(folder / "out/run.yaml"),
             Catch::Contains("count: 2") && Catch::Contains("image_0/000005.png: the file is empty"));
  CHECK_THAT(run.out, Catch::Contains("1 of 8 frames WEAK: right image missing or in doubt (1)\n"));
  CHECK_THAT(read_text(folder / "run.json"), Catch::Contains("\"right_image_unfit\": 1"));
  CHECK_THAT(read_text(folder / "run.json"),
             Catch::Contains("\"frame\": 3") && Catch::Contains("image_0/000005.png: the file is empty"));
  CHECK(split_lines(read_text(folder / "out/trajectory_kitti.txt")).size() == 8);
}

TEST_CASE("A run without a readable image but the first says that this is why nothing was tracked", "[cli]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 5);
  for (int i = 1; i < 5; ++i) truncate_file(folder / "in/image_0" / frame_name(i), 0.5);
  check_one_line_failure(call({"run", "--quiet", "--dataset", folder / "in", "--output", folder / "out"}),
                         "because 4 images could not be read; the first: ");
}

TEST_CASE("Every other failure gives one line and status 1", "[cli]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 3);
  write_text(folder / "bad.yaml", "features: {count: 1}\n");
  write_text(folder / "file", "");
  const std::string in = folder / "in";
  check_one_line_failure(
      call({"run", "--dataset", in, "--output", folder / "o", "--config", folder / "bad.yaml"}),
      "features.count");
  check_one_line_failure(
      call({"run", "--dataset", in, "--output", folder / "o", "--config", folder / "no.yaml"}), "no.yaml");
  check_one_line_failure(call({"run", "--dataset", in, "--output", folder / "file"}), "--output");
  check_one_line_failure(call({"run", "--dataset", in, "--output", folder / "o", "--format", "euroc"}),
                         "has no cam0 and cam1");
  check_one_line_failure(call({"run", "--dataset", in, "--output", folder / "o", "--pose-frame", "body"}),
                         "leave out --pose-frame body");
  check_one_line_failure(call({"info", "--dataset", in, "--write-groundtruth", folder / "no/such/place.txt"}),
                         "place.txt");
  check_one_line_failure(
      call({"evaluate", "--groundtruth", in + "/poses.txt", "--estimate", in + "/none.txt"}), "none.txt");
  check_one_line_failure(call({"simulate", "--output", folder / "s", "--trajectory", in + "/none.txt"}),
                         "none.txt");
}

TEST_CASE("--view without a display gives one line and status 1", "[cli]") {
  if (std::getenv("DISPLAY") != nullptr || std::getenv("WAYLAND_DISPLAY") != nullptr) return;
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 2);
  check_one_line_failure(call({"run", "--dataset", folder / "in", "--output", folder / "o", "--view"}),
                         "--view");
}

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

TEST_CASE("simulate writes a recording that run and info accept", "[cli]") {
  const TemporaryFolder folder;
  const auto simulated =
      call({"simulate", "--output", folder / "s", "--frames", "3", "--scale", "0.25", "--quiet"});
  CHECK(simulated.err.empty());
  CHECK(simulated.status == 0);
  const auto info = call({"info", "--dataset", folder / "s"});
  CHECK(info.status == 0);
  CHECK_THAT(info.out, Catch::Contains("310 x 94 px") && Catch::Contains("ground truth  3 poses"));
  CHECK(call({"run", "--dataset", folder / "s", "--output", folder / "o", "--quiet"}).status == 0);
}
