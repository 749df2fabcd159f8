// SPDX-License-Identifier: MIT
#include "stereo_slam/report/run_data.hpp"

#include <cmath>
#include <limits>

#include <nlohmann/json.hpp>

#include "stereo_slam/report/drive.hpp"
#include "stereo_slam/report/rounding.hpp"
#include "stereo_slam/report/trajectory_geometry.hpp"
#include "stereo_slam/report/truth_errors.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;
using nlohmann::json;

namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

}  // namespace

TEST_CASE("The data of a run has its final state and key figures", "[report]") {
  auto record = drive(101);
  record.results[50].status = TrackingStatus::kLost;
  record.loops = {{90, 10, false, 55, 3.25, true}, {95, 12, false, 31, 99.0, false}};
  const json data = report::run_data(record, {.header = {.state = "interrupted", .error = "", .seconds = 2.5},
                                              .dataset = "/data/street",
                                              .preset = "paper"});
  CHECK(data["kind"] == "run");
  CHECK(data["title"] == "street");
  CHECK(data["state"] == "interrupted");
  CHECK(data["preset"] == "paper");
  CHECK(data["length_m"] == 100.0);
  CHECK(data["median_ms"] == 17.0);
  CHECK(data["keyframe_count"] == 11);
  CHECK(data["status_counts"] == json({1, 99, 0, 1, 0}));
  CHECK(data["loop_counts"] == json({{"accepted", 1}, {"refused", 1}}));
  CHECK(data["loops"][0] == json({{"frame", 90},
                                  {"old_frame", 10},
                                  {"in_loaded_map", false},
                                  {"inliers", 55},
                                  {"chi2", 3.25},
                                  {"accepted", true}}));
}

TEST_CASE("The data of a run tells why frames are weak or lost, and how many", "[report]") {
  auto record = drive(101);
  for (const std::size_t k : {20U, 21U}) {
    record.results[k].status = TrackingStatus::kWeak;
    record.results[k].weak.few_landmarks = true;
  }
  record.results[21].weak.segment_not_localised = true;
  record.results[22].status = TrackingStatus::kLost;
  record.results[22].weak.segment_not_localised = true;
  const json data = report::run_data(record, {});
  REQUIRE(data["reasons"].size() == kWeakReasons.size());
  CHECK(data["reasons"][3] == json({{"text", "few landmarks"}, {"weak", 2}, {"lost", 0}}));
  CHECK(data["reasons"][8] == json({{"text", "place in the map unknown"}, {"weak", 1}, {"lost", 1}}));
  const json& reasons = data["frames"]["reasons"];
  CHECK(reasons[19] == 0);
  CHECK(reasons[20] == 0b1000);
  CHECK(reasons[21] == 0b100001000);
  CHECK(reasons[22] == 0b100000000);
}

TEST_CASE("Every quantity has an element for every frame", "[report]") {
  const json data = report::run_data(
      drive(101), {.header = {}, .dataset = "", .preset = "", .ground_truth = true_drive(101)});
  const json& frames = data["frames"];
  for (const auto& [name, values] : frames.items()) {
    CAPTURE(name);
    if (name == "stages") continue;
    const std::size_t width =
        name == "quaternion_xyzw"                                                            ? 4
        : name == "position_m" || name == "sigma_position_m" || name == "sigma_rotation_deg" ? 3
                                                                                             : 1;
    CHECK(values.size() == width * 101);
  }
  CHECK(frames["stages"][1]["name"] == "odometry");
  CHECK(frames["stages"][1]["ms"][100] == 5.0);
  CHECK(frames["time_s"][100] == 10.0);
  CHECK(frames["speed_mps"][100] == 10.0);
  CHECK(frames["position_m"][3 * 100 + 2] == 100.0);
  CHECK(frames["sigma_position_m"][3 * 100] == 0.01);
  CHECK(std::isnan(frames["nis_per_dof"][0].get<double>()));
  CHECK(data["truth"]["error_m"].size() == 101);
}

TEST_CASE("The path without loops is shown if a loop of the run was accepted, and none with a loaded map",
          "[report]") {
  auto record = drive(101);
  CHECK(report::run_data(record, {})["without_loops_m"].is_null());
  record.loops = {{95, 12, false, 31, 99.0, false}};
  CHECK(report::run_data(record, {})["without_loops_m"].is_null());
  record.loops.push_back({90, 10, false, 55, 3.25, true});
  CHECK(report::run_data(record, {})["without_loops_m"].size() == 303);
  record.loops.push_back({91, 10, true, 55, 3.25, true});
  CHECK(report::run_data(record, {})["without_loops_m"].is_null());
}

TEST_CASE("Of a long run the worst tracked frames are shown, and the last", "[report]") {
  std::vector<TrackingStatus> statuses(1003, TrackingStatus::kOk);
  statuses[17] = TrackingStatus::kWeak;
  statuses[18] = TrackingStatus::kLost;
  const auto rows = report::shown_frames(statuses, 101);
  CHECK(rows.size() <= 101);
  CHECK(std::is_sorted(rows.begin(), rows.end()));
  CHECK(std::count(rows.begin(), rows.end(), 18U) == 1);
  CHECK(rows.front() == 0);
  CHECK(rows.back() == 1002);
  CHECK(report::shown_frames(std::span(statuses).first(3), 101) == std::vector<std::size_t>{0, 1, 2});
  CHECK(report::shown_frames({}, 101).empty());
}

TEST_CASE("Ellipsoids lie at equal distances along the path; a standing camera has none", "[report]") {
  auto record = drive(401);
  const json ellipsoids = report::run_data(record, {})["ellipsoids"];
  REQUIRE(ellipsoids.size() == 40);
  CHECK(ellipsoids[0]["frame"] == 10);
  CHECK(ellipsoids[39]["frame"] == 400);
  CHECK(ellipsoids[39]["half_axes"][0] == 0.02);
  for (auto& estimate : record.trajectory) estimate.pose = Pose::identity();
  CHECK(report::run_data(record, {})["ellipsoids"].empty());
}

TEST_CASE("Map points far from the path are left out, and many are thinned out", "[report]") {
  auto record = drive(10);
  record.map_points.push_back({{1e7, 0.0, -1e7}, 9});
  CHECK(report::run_data(record, {})["map"]["intensity"].size() == 10);
  record.map_points.resize(50'000);
  CHECK(report::run_data(record, {})["map"]["positions"].size() == 36'000);
}

TEST_CASE("The ellipsoid of one standard deviation turns with the camera", "[report]") {
  PoseGaussian estimate;
  estimate.covariance.diagonal() << 0, 0, 0, 0.04, 0.01, 0.25;
  const double turn_rad = 0.3;
  estimate.pose = Pose::exp((Vector6<double>() << 0.0, turn_rad, 0.0, 0.0, 0.0, 0.0).finished());
  const auto ellipsoid = report::sigma_ellipsoid(estimate);
  CHECK(ellipsoid.half_axes_m.isApprox(Vector3<double>(0.1, 0.2, 0.5)));
  const Vector3<double> longest = ellipsoid.R_world_ellipsoid * Vector3<double>::UnitZ();
  CHECK(std::abs(longest.dot(Vector3<double>(std::sin(turn_rad), 0.0, std::cos(turn_rad)))) == Approx(1.0));
}

TEST_CASE("The speed is NaN where time stands still", "[report]") {
  const auto record = drive(3);
  const std::vector<std::int64_t> stamps_ns = {0, 100'000'000, 100'000'000};
  const auto speeds = report::speeds(record.trajectory, stamps_ns);
  CHECK(speeds[0] == Approx(10.0));
  CHECK(speeds[1] == Approx(10.0));
  CHECK(std::isnan(speeds[2]));
  CHECK(std::isnan(report::speeds(std::span(record.trajectory).first(1), stamps_ns)[0]));
}

TEST_CASE("A path equal to the ground truth in another world has no errors", "[report]") {
  const auto errors = report::truth_errors(drive(50), true_drive(50));
  REQUIRE(errors);
  constexpr double kRounding = 1e-9;
  CHECK(errors->ate_m.rmse < kRounding);
  for (std::size_t k = 0; k < 50; ++k) {
    CHECK(errors->error_m[k] < kRounding);
    CHECK(errors->error_rad[k] < 1e-7);
  }
  CHECK(errors->nees[20] < kRounding);
  CHECK(std::isnan(errors->nees[25]));
}

TEST_CASE("Errors are those of the frames that the ground truth has", "[report]") {
  auto record = drive(50);
  record.trajectory[20].pose = at({0.0, 1.0, 20.0});
  auto truth = true_drive(40);
  const auto errors = report::truth_errors(record, truth);
  REQUIRE(errors);
  CHECK(errors->error_m[20] == Approx(1.0).margin(0.1));
  CHECK(errors->nees[20] > 1000.0);
  CHECK(std::isnan(errors->error_m[45]));
  CHECK(std::isnan(errors->position_m[45].x()));
  truth.poses.resize(2);
  truth.stamps_ns.resize(2);
  CHECK_FALSE(report::truth_errors(record, truth));
  CHECK_FALSE(report::truth_errors(record, {}));
}

TEST_CASE("Numbers are rounded to decimals and to digits", "[report]") {
  CHECK(report::to_decimals(1.23456, 3) == 1.235);
  CHECK(json(report::to_decimals(-1e-9, 3)).dump() == "0.0");
  CHECK(report::to_digits(0.000123456, 3) == Approx(0.000123).epsilon(1e-12));
  CHECK(report::to_digits(123456.0, 3) == 123000.0);
  CHECK(report::to_digits(0.0, 3) == 0.0);
  CHECK(std::isnan(report::to_digits(kNaN, 3)));
  CHECK(json(report::to_decimals(kNaN, 3)).dump() == "null");
}

TEST_CASE("What an IMU told is in the data of the frames in which its filter ran, with standard deviations",
          "[report][imu]") {
  auto record = drive(4);
  CHECK(report::run_data(record, {})["inertial"].is_null());
  InertialEstimate& estimate = record.results[2].inertial;
  estimate.phase = InertialPhase::kRunning;
  estimate.velocity << 1.0, 2.0, 3.0;
  estimate.gravity << 0.0, 9.81 * std::sin(0.2), -9.81 * std::cos(0.2);
  estimate.biases << 0.01, 0.0, 0.0, 0.0, 0.0, 0.3;
  estimate.delay_s = -0.02;
  estimate.covariance.diagonal().setConstant(0.01);
  const json data = report::run_data(record, {})["inertial"];
  REQUIRE(data["velocity_m_s"].size() == 12);
  CHECK(std::isnan(data["velocity_m_s"][0].get<double>()));
  CHECK(data["velocity_m_s"][7] == 2.0);
  CHECK(data["sigma_velocity_m_s"][7] == 0.1);
  constexpr double kDegrees = 57.29578;
  CHECK(data["elevation_deg"][6] == 0.0);
  CHECK(data["elevation_deg"][7].get<double>() == Approx(-0.2 * kDegrees).margin(1e-4));  // the axis dips
  CHECK(data["elevation_deg"][8].get<double>() == Approx(90.0 - 0.2 * kDegrees).margin(1e-4));
  CHECK(data["sigma_elevation_deg"][6].get<double>() == Approx(0.1 / 9.81 * kDegrees).epsilon(0.005));
  CHECK(data["gyroscope_bias_deg_s"][6].get<double>() == Approx(0.01 * kDegrees).margin(1e-4));
  CHECK(data["accelerometer_bias_m_s2"][8] == 0.3);
  REQUIRE(data["delay_ms"].size() == 4);
  CHECK(data["delay_ms"][2] == -20.0);
  CHECK(data["sigma_delay_ms"][2] == 100.0);
}
