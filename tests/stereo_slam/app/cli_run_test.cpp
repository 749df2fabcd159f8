// SPDX-License-Identifier: MIT
#include "stereo_slam/support/program.hpp"

using namespace stereo_slam::test;

namespace {

constexpr auto kLoopsHeader = "frame,old_frame,inliers,chi2,verdict,old_map,tx,ty,tz,qx,qy,qz,qw\n";

}  // namespace

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

TEST_CASE("A run begins with what an earlier one learned of the cameras", "[cli]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "seq", 5);
  const auto run = [&](std::vector<std::string> more) {
    std::vector<std::string> arguments = {"run",          "--overwrite", "--dataset",
                                          folder / "seq", "--output",    folder / "out"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return call(arguments);
  };
  REQUIRE(run({}).status == 0);
  const std::string file = folder / "cameras.yaml";
  fs::rename(folder / "out/cameras.yaml", file);
  const auto again = run({"--learned", file});
  CHECK(again.status == 0);
  CHECK_THAT(again.err, !Catch::Contains("--learned"));
  check_one_line_failure(run({"--learned", folder / "none.yaml"}), "none.yaml");
  check_one_line_failure(run({"--learned", folder / "out/run.yaml"}), "run.yaml");
  check_one_line_failure(run({"--learned", file, "--preset", "paper"}), "--learned");
  CHECK(run({"--learned", file, "--load-map", file}).status == 2);
  std::string text = read_text(file);
  text.replace(text.find("fx: "), 4, "fx: 9");
  write_text(file, text);
  check_one_line_failure(run({"--learned", file}), "another camera");
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
