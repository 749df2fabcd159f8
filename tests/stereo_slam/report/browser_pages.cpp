// SPDX-License-Identifier: MIT
// browser_pages DIR: writes the pages that browser_test.sh opens, and beside each what the browser should
// find in it.
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "stereo_slam/report/comparison.hpp"
#include "stereo_slam/report/drive.hpp"
#include "stereo_slam/report/report.hpp"

namespace {

using namespace stereo_slam;
using nlohmann::json;

constexpr int kCharts = 9;  // without ground truth and IMU

/// Two laps of a circle with loops, losses, images and ground truth.
RunRecord laps(std::size_t frames) {
  RunRecord record = test::drive(frames);
  for (std::size_t k = 0; k < frames; ++k) {
    const double turn = 4.0 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(frames);
    const double s = std::sin(0.5 * turn), c = std::cos(0.5 * turn);
    const Vector3<double> position(30.0 - 30.0 * std::cos(turn), 0.5 * std::sin(3.0 * turn),
                                   30.0 * std::sin(turn));
    record.trajectory[k].pose =
        Pose::from_rotation_translation(antipode::Vector4<double>(c, 0.0, s, 0.0), position);
    record.trajectory[k].covariance *= 10.0;
    record.results[k].T_odometry_camera =
        test::at({0.0, 0.0, 0.02 * static_cast<double>(k)}) * record.trajectory[k].pose;
    record.map_points[k].position_world = position * 1.2 - Vector3<double>(0.0, 2.0, 0.0);
  }
  for (std::size_t k = 10; k < frames; ++k) {  // the IMU's filter starts then
    InertialEstimate& inertial = record.results[k].inertial;
    inertial.phase = InertialPhase::kRunning;
    inertial.velocity << 0.1, 0.0, 7.0;
    inertial.gravity << 0.0, 9.8, 0.4;
    inertial.covariance.diagonal().setConstant(1e-3);
  }
  for (std::size_t k = 120; k < 140; ++k) {
    record.results[k].status = TrackingStatus::kLost;
    record.results[k].weak.right_image_unfit = true;
  }
  record.results[140].status = TrackingStatus::kRelocalised;
  for (std::size_t k = 60; k < 70; ++k) {
    record.results[k].status = TrackingStatus::kWeak;
    record.results[k].weak = {.few_landmarks = true, .segment_not_localised = k < 65};
  }
  record.loops = {{frames / 2 + 5, 5, false, 55, 3.25, true}, {frames / 2 + 20, 80, false, 31, 99.0, false}};
  return record;
}

report::RunInfo info_of(const RunRecord& record) {
  report::RunInfo info{.header = {.state = "finished", .error = "", .seconds = 12.0, .peak_mb = 200.0},
                       .dataset = "/data/</script><b>two laps</b>",
                       .preset = "default"};
  for (std::size_t k = 0; k < record.results.size(); k += 20) {
    cv::Mat image(80, 200, CV_8UC1, cv::Scalar(static_cast<double>(k % 255)));
    info.thumbnails.push_back({k, report::to_jpeg(image)});
  }
  return info;
}

void write(const std::filesystem::path& folder, const std::string& name, const RunRecord& record,
           const report::RunInfo& info, const json& expected) {
  std::ofstream page(folder / (name + ".html"));
  report::write_report(page, record, info);
  std::ofstream(folder / (name + ".json")) << expected.dump();
}

void write_pages(const std::filesystem::path& folder) {
  const RunRecord record = laps(400);
  report::RunInfo info = info_of(record);
  for (std::size_t k = 0; k < record.results.size(); ++k) {
    info.ground_truth.stamps_ns.push_back(record.results[k].stamp_ns);
    info.ground_truth.poses.push_back((record.trajectory[k].pose * test::at({0.1, 0.0, 0.0})).isometry());
  }
  const json texts = {"two laps</b>",      "20 of 400 frames were lost", "ground truth", "refused",
                      "1 sigma, enlarged", "Why frames are weak",        "few landmarks"};
  const json full = {{"texts", texts},
                     {"charts", kCharts + 3 + 5},
                     {"view", true},
                     {"interactive", true},
                     {"turns", true},
                     {"frame_at_30_percent", 120},
                     {"reasons_at_30_percent", {"nothing measured the pose", "right image missing"}}};
  write(folder, "laps", record, info, full);
  json flat = full;
  flat["turns"] = false;
  flat["texts"].push_back("no WebGL");
  write(folder, "laps-without-webgl", record, info, flat);
  write(folder, "empty", {},
        {.header = {.state = "failed", .error = "cannot <read>", .seconds = 0.0},
         .dataset = "/x",
         .preset = ""},
        {{"texts", {"no frames", "cannot <read>", "failed"}}, {"charts", 0}, {"view", false}});
  write(folder, "single", test::drive(1), {},
        {{"texts", {"single frame"}}, {"charts", kCharts}, {"view", true}});
  RunRecord lost = laps(200);
  for (auto& result : lost.results) {
    result.status = TrackingStatus::kLost;
    result.nis_dof = 0;
  }
  for (auto& value : lost.resident_mb) value = std::numeric_limits<double>::quiet_NaN();
  lost.trajectory[50].covariance.setConstant(std::numeric_limits<double>::quiet_NaN());
  lost.map_points.clear();
  write(folder, "lost", lost, info_of(lost),
        {{"texts", {"No frame could be tracked", "No values."}}, {"charts", kCharts + 5}, {"view", true}});
}

/// What `compare` reads of a record.
report::RunFolder folder_of(const std::string& name, const RunRecord& record) {
  report::RunFolder run;
  run.folder = name;
  run.entries = {{"state", "finished"}, {"dataset.folder", "/data/laps"}, {"settings.preset", name}};
  for (std::size_t k = 0; k < record.results.size(); ++k) {
    run.trajectory.stamps_ns.push_back(record.results[k].stamp_ns);
    run.trajectory.poses.push_back(record.trajectory[k].pose.isometry());
    run.sigma_m.push_back(0.001 * static_cast<double>(k));
    run.nis_per_dof.push_back(1.0);
  }
  run.total_ms = record.total_ms;
  run.resident_mb = record.resident_mb;
  return run;
}

void write_comparison_pages(const std::filesystem::path& folder) {
  const RunRecord record = laps(400);
  std::vector<report::RunFolder> runs = {folder_of("default", record), folder_of("<b>paper</b>", laps(300))};
  report::RunFolder crashed;
  crashed.folder = "crashed";
  crashed.problem = "has no timing.csv";
  crashed.entries = {{"state", "running"}, {"dataset.folder", "/data/laps"}};
  runs.push_back(crashed);
  std::ofstream page(folder / "comparison.html");
  report::write_comparison(page, runs, report::ComparisonTruth{runs[0].trajectory});
  const json expected = {
      {"texts", {"<b>paper</b>", "has no timing.csv", "ATE, m", "Settings", "ground truth"}},
      {"charts", 5},
      {"view", true},
      {"interactive", true},
      {"turns", true}};
  std::ofstream(folder / "comparison.json") << expected.dump();
  std::ofstream nothing(folder / "comparison-of-nothing.html");
  report::write_comparison(nothing, {crashed}, std::nullopt);
  std::ofstream(folder / "comparison-of-nothing.json")
      << json({{"texts", {"crashed", "No frames."}}, {"charts", 4}, {"view", true}}).dump();
}

}  // namespace

int main(int argc, char** argv) {
  try {
    if (argc != 2) throw std::invalid_argument("usage: browser_pages DIR");
    write_pages(argv[1]);
    write_comparison_pages(argv[1]);
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "browser_pages: {}\n", error.what());
    return 1;
  }
}
