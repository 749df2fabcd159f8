// SPDX-License-Identifier: MIT
#include "stereo_slam/report/comparison.hpp"

#include <algorithm>
#include <iterator>
#include <regex>
#include <sstream>

#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "stereo_slam/io/text_file.hpp"
#include "stereo_slam/report/drive.hpp"
#include "stereo_slam/report/page_data.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;
using nlohmann::json;

namespace {

/// Writes the files of a run; `settings` are lines of YAML.
void write_run(const fs::path& folder, const RunRecord& record, const std::string& settings) {
  fs::create_directories(folder);
  write_results(folder, record);
  write_text(folder / "run.yaml",
             "version: 0.1.0\nstate: finished\nseconds: 12.5\nmemory:\n  peak_mb: 99.5\ndataset:\n  folder: "
             "/data/street\nsettings:\n" +
                 settings);
}

RunRecord slower_drive(std::size_t frames) {
  auto record = drive(frames);
  for (auto& ms : record.total_ms) ms *= 2.0;
  record.results[10].status = TrackingStatus::kLost;
  record.trajectory[20].pose = at({0.0, 3.0, 20.0});
  record.loops = {{40, 4, false, 31, 2.0, true}, {41, 4, false, 31, 99.0, false}};
  return record;
}

}  // namespace

TEST_CASE("A comparison has the scores, costs and differing settings of its runs", "[compare]") {
  const TemporaryFolder folder;
  write_run(folder / "a", drive(50), "  preset: default\n  features:\n    count: 1000\n");
  write_run(folder / "b", slower_drive(50), "  preset: default\n  features:\n    count: 500\n");
  const std::vector runs = {report::read_run_folder(folder / "a"), report::read_run_folder(folder / "b/")};
  const json data = report::comparison_data(runs, report::ComparisonTruth{true_drive(50)});
  CHECK(data["title"] == "Comparison of 2 runs");
  CHECK(data["subtitle"] == "/data/street");
  CHECK(data["differences"] == json({{{"key", "features.count"}, {"values", {"1000", "500"}}}}));
  const json &a = data["runs"][0], &b = data["runs"][1];
  CHECK(a["name"] == "a");
  CHECK(b["name"] == "b");
  CHECK(a["frame_count"] == 50);
  CHECK(a["length_m"] == 49.0);
  CHECK(a["seconds"] == 12.5);
  CHECK(a["peak_mb"] == 99.5);
  CHECK(a["median_ms"] == 17.0);
  CHECK(b["median_ms"] == 34.0);
  CHECK(b["lost"] == 1);
  CHECK(b["loops"] == 1);
  CHECK(a["scores"]["ate_m"] < 1e-6);
  CHECK(b["scores"]["ate_m"] > 0.3);
  CHECK(b["error_m"][20] == Approx(3.0).margin(0.5));
  CHECK(a["time_s"][49] == Approx(4.9));
  CHECK(a["position_m"].size() == 150);
  CHECK(a["sigma_m"][49] == Approx(std::sqrt(3.0 * 49e-6)).epsilon(1e-3));
  CHECK(data["truth_position_m"].size() == 150);
}

TEST_CASE("Ground truth without stamps is matched by the order of frames", "[compare]") {
  const TemporaryFolder folder;
  write_run(folder / "a", drive(30), "  preset: default\n");
  auto truth = true_drive(30);
  truth.stamps_ns.clear();
  const json data =
      report::comparison_data({report::read_run_folder(folder / "a")}, report::ComparisonTruth{truth});
  CHECK(data["runs"][0]["scores"]["ate_m"] < 1e-6);
}

TEST_CASE("A run that has not ended and a ground truth that does not fit are named, not errors",
          "[compare]") {
  const TemporaryFolder folder;
  write_run(folder / "a", drive(30), "  preset: default\n");
  write_run(folder / "b", drive(30), "  preset: default\n");
  fs::remove(folder / "b/timing.csv");
  write_run(folder / "empty", {}, "  preset: default\n");
  auto truth = true_drive(30);
  for (auto& stamp_ns : truth.stamps_ns) stamp_ns += 3'600'000'000'000;
  const std::vector runs = {report::read_run_folder(folder / "a"), report::read_run_folder(folder / "b"),
                            report::read_run_folder(folder / "empty")};
  const json data = report::comparison_data(runs, report::ComparisonTruth{truth});
  CHECK_THAT(data["runs"][0]["problem"].get<std::string>(), Catch::Contains("match"));
  CHECK(data["runs"][0]["scores"].is_null());
  CHECK_THAT(data["runs"][1]["problem"].get<std::string>(), Catch::Contains("timing.csv"));
  CHECK(data["runs"][1]["time_s"].empty());
  CHECK(data["runs"][2]["frame_count"] == 0);
}

TEST_CASE("Runs of the same name are told apart by their folders", "[compare]") {
  const TemporaryFolder folder;
  write_run(folder / "x/06", drive(5), "  preset: default\n");
  write_run(folder / "y/06", drive(5), "  preset: default\n");
  const std::vector runs = {report::read_run_folder(folder / "x/06"),
                            report::read_run_folder(folder / "y/06")};
  const json data = report::comparison_data(runs, std::nullopt);
  CHECK(data["runs"][0]["name"] != data["runs"][1]["name"]);
}

TEST_CASE("A run of before the column of the reasons can be compared", "[compare]") {
  const TemporaryFolder folder;
  write_run(folder / "a", slower_drive(50), "  preset: default\n");
  const auto file = folder / "a/covariances.csv";
  write_text(file, std::regex_replace(read_text(file), std::regex(",[^,\n]*\n"), "\n"));
  CHECK(report::read_run_folder(folder / "a").lost == 1);
}

TEST_CASE("A covariances.csv that is cut off, or has reasons of no version, is refused with its line",
          "[compare]") {
  const TemporaryFolder folder;
  write_run(folder / "a", slower_drive(50), "  preset: default\n");
  const auto file = folder / "a/covariances.csv";
  const std::string text = read_text(file);
  const auto refusal = [&](const std::string& with_fault) {
    write_text(file, with_fault);
    return message_of([&] { (void)report::read_run_folder(folder / "a"); });
  };
  CHECK(refusal(text).empty());
  for (const std::string cut : {"reason", "r", ""}) {
    CHECK_THAT(
        refusal(std::regex_replace(text, std::regex("reasons"), cut)),
        Catch::Contains("covariances.csv:1: the names of the columns are cut off after '" + cut + "'"));
  }
  CHECK_THAT(refusal(text.substr(0, text.size() - 1)), Catch::Contains("covariances.csv:51: the last line"));
  auto lines = split_lines(text);
  lines.at(7) += "few_land";
  CHECK_THAT(
      refusal(fmt::format("{}\n", fmt::join(lines, "\n"))),
      Catch::Contains("covariances.csv:8: 'few_land' in the column reasons is none of: odometry_alone"));
}

TEST_CASE("Folders that are no runs and damaged files are errors that name the file", "[compare]") {
  const TemporaryFolder folder;
  CHECK_THROWS_WITH(report::read_run_folder(folder / "none"), Catch::Contains("none/run.yaml: not found"));
  write_run(folder / "a", drive(5), "  preset: default\n");
  const std::string loops = read_text(folder / "a/loops.csv");
  write_text(folder / "a/loops.csv", "foo\n");
  CHECK_THROWS_WITH(report::read_run_folder(folder / "a"),
                    Catch::Contains("loops.csv: has no column 'verdict'"));
  write_text(folder / "a/loops.csv", loops);
  const std::string covariances = read_text(folder / "a/covariances.csv");
  auto lines = split_lines(covariances);
  const auto names = split_fields(lines.at(0));
  const auto fields = split_fields(lines.at(2));
  const auto variance = fields.at(static_cast<std::size_t>(
      std::distance(names.begin(), std::find(names.begin(), names.end(), "ty_ty_m2"))));
  const auto offset = static_cast<std::size_t>(variance.data() - lines.at(2).data());
  const std::size_t size = variance.size();
  for (const std::string wrong : {"-1", "nan", ""}) {
    auto changed = lines;
    changed.at(2).replace(offset, size, wrong);
    write_text(folder / "a/covariances.csv", fmt::format("{}\n", fmt::join(changed, "\n")));
    CHECK_THROWS_WITH(report::read_run_folder(folder / "a"),
                      Catch::Contains("covariances.csv: row 2 has a variance below zero"));
  }
  auto status = lines;
  status.at(3) = std::regex_replace(status.at(3), std::regex("OK|WEAK|INITIALIZING|LOST"), "FINE");
  write_text(folder / "a/covariances.csv", fmt::format("{}\n", fmt::join(status, "\n")));
  CHECK_THROWS_WITH(report::read_run_folder(folder / "a"),
                    Catch::Contains("covariances.csv:4: \"FINE\" is not a status"));
  write_text(folder / "a/covariances.csv", covariances);
  std::string timing = read_text(folder / "a/timing.csv");
  const auto second_row = timing.find('\n', timing.find('\n') + 1) + 1;
  for (auto i = second_row; timing[i] != '\n'; ++i) {
    if (timing[i] >= '0' && timing[i] <= '9') timing[i] = 'x';
  }
  write_text(folder / "a/timing.csv", timing);
  CHECK_THROWS_WITH(report::read_run_folder(folder / "a"),
                    Catch::Contains("timing.csv: 'x") && Catch::Contains("of row 2 is no number"));
  const std::string poses = read_text(folder / "a/trajectory_tum.txt");
  write_text(folder / "a/trajectory_tum.txt", "");
  CHECK_THROWS_WITH(report::read_run_folder(folder / "a"),
                    Catch::Contains("covariances.csv: has 5 rows for 0 poses in trajectory_tum.txt"));
  write_text(folder / "a/trajectory_tum.txt", poses);
  write_text(folder / "a/timing.csv", "frame,total_ms\n0,1\n1\n");
  CHECK_THROWS_WITH(report::read_run_folder(folder / "a"), Catch::Contains("timing.csv:3: has 1 field,"));
  write_text(folder / "a/run.yaml", "version: [\n");
  CHECK_THROWS_WITH(report::read_run_folder(folder / "a"),
                    Catch::Contains("run.yaml:") && Catch::Contains("YAML"));
  CHECK_THROWS_AS(report::comparison_data({}, std::nullopt), std::invalid_argument);
}

TEST_CASE("Twenty long runs fit on one page below four megabytes", "[compare]") {
  std::vector<report::RunFolder> runs(20);
  for (auto& run : runs) {
    const auto record = drive(5000);
    for (std::size_t k = 0; k < 5000; ++k) {
      run.trajectory.stamps_ns.push_back(record.results[k].stamp_ns);
      run.trajectory.poses.push_back(at({0.123, 0.456, 1.001 * static_cast<double>(k)}).isometry());
    }
    run.sigma_m = run.nis_per_dof = run.total_ms = run.resident_mb = std::vector<double>(5000, 12.34);
  }
  std::ostringstream text;
  report::write_comparison(text, runs, std::nullopt);
  CHECK(text.str().size() < 4'000'000);
  CHECK(page_data(text.str())["runs"].size() == 20);
}
