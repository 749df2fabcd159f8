// SPDX-License-Identifier: MIT
// What scripts and readers of --help get from the command line.
#include <algorithm>
#include <csignal>

#include <nlohmann/json.hpp>

#include "stereo_slam/support/program.hpp"

using namespace stereo_slam::test;

namespace {

nlohmann::json read_json(const fs::path& file) { return nlohmann::json::parse(read_text(file)); }

}  // namespace

TEST_CASE("run --json says how a run went, also one that fails", "[cli]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 8);
  const std::vector<std::string> run = {"run",         "--quiet",      "--dataset", folder / "in",
                                        "--output",    folder / "out", "--json",    folder / "run.json",
                                        "--overwrite", "--strict"};
  REQUIRE(call(run).status == 0);
  auto json = read_json(folder / "run.json");
  CHECK(json["state"] == "finished");
  CHECK(json["error"] == "");
  CHECK(json["format"] == "kitti");
  CHECK(json["frames"] == 8);
  CHECK(json["frames_lost"] == 0);
  CHECK(json["frames_by_status"]["OK"] == 7);
  CHECK(json["weak_frames_by_reason"].empty());
  CHECK(json["path_m"].get<double>() == Approx(7 * 0.16).margin(0.1));
  CHECK(json["last_sigma_m"].get<double>() > 0.0);
  CHECK(json["frame"]["median_ms"].get<double>() > 0.0);
  CHECK(json["output"] == (folder / "out").string());

  truncate_file(folder / "in/image_0" / frame_name(5), 0.5);
  CHECK(call(run).status == 1);  // the first file is replaced
  json = read_json(folder / "run.json");
  CHECK(json["state"] == "failed");
  CHECK(json["frames"] == 5);
  CHECK_THAT(json["error"].get<std::string>(), Catch::Contains("000005.png"));
}

TEST_CASE("run --json in the output folder is among the results", "[cli]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 4);
  const auto result = call(
      {"run", "--dataset", folder / "in", "--output", folder / "out", "--json", folder / "out/summary.json"});
  CAPTURE(result.err);
  CHECK(result.status == 0);
  CHECK(read_json(folder / "out/summary.json")["frames"] == 4);
}

TEST_CASE("run --json replaces nothing but an earlier one", "[cli]") {
  const TemporaryFolder folder;
  write_tiny_sequence(folder / "in", 4);
  write_text(folder / "thesis.json", "{\"chapters\": 7}");
  write_text(folder / "settings.yaml", "seed: 2\n");
  const auto run_with = [&](const fs::path& json) {
    return call({"run", "--dataset", folder / "in", "--output", folder / "out", "--config",
                 folder / "settings.yaml", "--json", json});
  };
  check_one_line_failure(run_with(folder / "thesis.json"), "exists, and is not a file of this kind");
  check_one_line_failure(run_with(folder / "settings.yaml"), "is to be read, too");
  check_one_line_failure(run_with(folder / "nowhere/run.json"), "nowhere");
  check_one_line_failure(run_with(folder / "out/report.html"), "is the name of a result file in --output");
  check_one_line_failure(call({"run", "--dataset", folder / "in", "--output", folder / "out", "--json",
                               folder / "both", "--save-map", folder / "./both"}),
                         "is the file of --save-map, too");
  CHECK_FALSE(fs::exists(folder / "out"));
  CHECK(read_text(folder / "thesis.json") == "{\"chapters\": 7}");
}

TEST_CASE("--help has examples, lists values by their names, and fits 100 columns", "[cli]") {
  for (const char* command : {"run", "info", "evaluate", "compare", "simulate"}) {
    CAPTURE(command);
    const auto help = call({command, "--help"});
    CHECK(help.status == 0);
    CHECK_THAT(help.out, Catch::Contains("Example"));
    for (const char* noise : {"->", "{", "ENUM", ":value"}) CHECK_THAT(help.out, !Catch::Contains(noise));
    const auto lines = split_lines(help.out);
    const auto longest = std::max_element(lines.begin(), lines.end(),
                                          [](const auto& a, const auto& b) { return a.size() < b.size(); });
    CAPTURE(*longest);
    CHECK(longest->size() <= 120);  // examples are not wrapped
  }
  const auto run = call({"run", "--help"});
  CHECK_THAT(run.out, Catch::Contains("--preset default|") && Catch::Contains("body|camera"));
  CHECK(call({"run", "--preset", "turbo"}).status == 2);
}
