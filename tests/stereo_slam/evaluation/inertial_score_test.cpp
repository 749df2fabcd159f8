// SPDX-License-Identifier: MIT
#include "stereo_slam/evaluation/inertial_score.hpp"

#include <cmath>
#include <numbers>
#include <random>
#include <sstream>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include "stereo_slam/results/inertial_table.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

using Vec = Eigen::Vector3d;
using Square = antipode::Matrix<double, InertialEstimate::kNumbers>;

constexpr std::int64_t kStep_ns = 50'000'000;
constexpr double kDelay_s = 0.015;

/// An IMU that turns and moves, in a world whose y axis points down.
[[nodiscard]] TrueInertialState true_state(int i) {
  const Eigen::AngleAxisd turn(0.1 * i, Vec(1, 2, 3).normalized());
  Vector6<double> biases;
  biases << 0.01, -0.02, 0.03, 0.1, 0.2, -0.1;
  return {kStep_ns * i, turn.toRotationMatrix(), Vec(1.0 + 0.1 * i, 0.3, -2.0), biases};
}

[[nodiscard]] std::vector<TrueInertialState> true_states(int count) {
  std::vector<TrueInertialState> states;
  states.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) states.push_back(true_state(i));
  return states;
}

/// A covariance of all numbers that has no error along gravity.
[[nodiscard]] Square covariance_about(const Vec& gravity, std::mt19937& random) {
  std::normal_distribution<double> normal;
  const Square A = Square::NullaryExpr([&] { return 0.01 * normal(random); });
  Square across = Square::Identity();
  across.block<3, 3>(3, 3) -= gravity.normalized() * gravity.normalized().transpose();
  return across * (A * A.transpose()) * across;
}

/// Estimates whose errors have their covariance, times `factor`.
[[nodiscard]] std::vector<InertialRow> estimates(int count, double factor) {
  std::mt19937 random(11);
  std::normal_distribution<double> normal;
  std::vector<InertialRow> rows;
  rows.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    const TrueInertialState truth = true_state(i);
    const Vec gravity = 9.81 * truth.R_world_imu.transpose() * Vec::UnitY();
    InertialEstimate estimate{.phase = InertialPhase::kRunning,
                              .velocity = truth.R_world_imu.transpose() * truth.velocity,
                              .gravity = gravity,
                              .biases = *truth.biases,
                              .delay_s = kDelay_s};
    estimate.covariance = covariance_about(gravity, random);
    const Eigen::LDLT<Eigen::MatrixXd> root(estimate.covariance);
    const Eigen::VectorXd scales = root.vectorD().cwiseMax(0.0).cwiseSqrt();
    Eigen::VectorXd unit(InertialEstimate::kNumbers);
    for (auto& x : unit) x = factor * normal(random);
    const Eigen::VectorXd scaled = scales.cwiseProduct(unit);
    const Eigen::VectorXd error =
        root.transpositionsP().transpose() * Eigen::VectorXd(root.matrixL() * scaled);
    estimate.velocity += error.head<3>();
    estimate.gravity += error.segment<3>(3);
    estimate.biases += error.segment<6>(6);
    estimate.delay_s += error[12];
    rows.push_back({kStep_ns * i, estimate});
  }
  return rows;
}

}  // namespace

TEST_CASE("An IMU's estimates equal to the truth have no errors, whatever axis of the world is vertical",
          "[evaluation][imu]") {
  for (const int axis : {0, 1, 2}) {
    for (const double sign : {1.0, -1.0}) {
      auto truth = true_states(30);
      auto rows = estimates(30, 0.0);
      Eigen::Matrix3d R;  // turns the vertical to another axis
      R.col(1) = sign * Vec::Unit(axis);
      R.col(2) = Vec::Unit((axis + 1) % 3);
      R.col(0) = R.col(1).cross(R.col(2));
      for (auto& state : truth) {
        state.R_world_imu = (R * state.R_world_imu).eval();
        state.velocity = (R * state.velocity).eval();
      }
      const InertialScore score = score_inertial(rows, truth, 0.01);
      CHECK(score.down == R.col(1));
      CHECK(score.velocity.frames == 30);
      CHECK(score.velocity.rms < 1e-12);
      CHECK(score.tilt.rms < 1e-12);
      CHECK(score.biases.rms + score.accelerometer_bias_rms < 1e-12);
      CHECK(score.tilt.share_inside == 1.0);
    }
  }
}

TEST_CASE("Errors as large as their covariance have the NEES of their degrees of freedom",
          "[evaluation][imu]") {
  constexpr int kFrames = 4000;
  const InertialScore score = score_inertial(estimates(kFrames, 1.0), true_states(kFrames), 0.01, kDelay_s);
  // The mean of n values of chi squared with d degrees has a standard error of sqrt(2 d / n): four of them.
  const auto margin = [](int degrees) { return 4.0 * std::sqrt(2.0 * degrees / kFrames); };
  CHECK(score.velocity.mean_nees == Approx(3.0).margin(margin(3)));
  CHECK(score.tilt.mean_nees == Approx(2.0).margin(margin(2)));
  CHECK(score.biases.mean_nees == Approx(6.0).margin(margin(6)));
  CHECK(score.delay.mean_nees == Approx(1.0).margin(margin(1)));
  const double share_margin = 4.0 * std::sqrt(0.95 * 0.05 / kFrames);
  for (const auto& part : {score.velocity, score.tilt, score.biases, score.delay})
    CHECK(part.share_inside == Approx(0.95).margin(share_margin));
  const InertialScore twice = score_inertial(estimates(kFrames, 2.0), true_states(kFrames), 0.01);
  CHECK(twice.velocity.mean_nees == Approx(12.0).margin(4.0 * margin(3)));
}

TEST_CASE("True velocities between two states are interpolated, and frames without states near are left out",
          "[evaluation][imu]") {
  auto rows = estimates(10, 0.0);
  std::vector<TrueInertialState> truth;
  for (int i = 0; i < 8; ++i) {
    for (const int side : {-1, 1}) {
      truth.push_back(true_state(i));
      truth.back().stamp_ns += side * 4'000'000;
      truth.back().velocity += side * Vec(0.3, 0.2, 0.1);
    }
  }
  const InertialScore score = score_inertial(rows, truth, 0.01);
  CHECK(score.velocity.frames == 8);
  CHECK(score.velocity.rms < 1e-12);
  CHECK_THAT(message_of([&] { (void)score_inertial(rows, truth, 0.001); }),
             Catch::Contains("no frame in which"));
  CHECK_THAT(message_of([&] { (void)score_inertial(rows, {}, 0.01); }), Catch::Contains("no frame in which"));
}

TEST_CASE("inertial.csv is read as it was written", "[evaluation][imu]") {
  const TemporaryFolder folder;
  const auto rows = estimates(5, 1.0);
  std::vector<FrameResult> results(6);
  for (std::size_t i = 0; i < 5; ++i) {
    results[i + 1].stamp_ns = rows[i].stamp_ns + 1;
    results[i + 1].inertial = rows[i].estimate;
  }
  results[0].inertial.phase = InertialPhase::kStarting;
  std::ostringstream text;
  write_inertial(text, results);
  write_text(folder / "inertial.csv", text.str());
  const auto read = read_inertial(folder / "inertial.csv");
  REQUIRE(read.size() == 5);  // without the frame in which the filter had not begun
  for (std::size_t i = 0; i < 5; ++i) {
    CHECK(read[i].stamp_ns == rows[i].stamp_ns + 1);
    CHECK((read[i].estimate.velocity - rows[i].estimate.velocity).norm() < 1e-7);
    CHECK((read[i].estimate.gravity - rows[i].estimate.gravity).norm() < 1e-7);
    CHECK(std::abs(read[i].estimate.delay_s - rows[i].estimate.delay_s) < 1e-9);
    CHECK((read[i].estimate.covariance - rows[i].estimate.covariance).norm() < 1e-7);
  }
}

TEST_CASE("Files that have no velocities, or are damaged, are refused with file and line",
          "[evaluation][imu][faults]") {
  const TemporaryFolder folder;
  const auto error_of_truth = [&](const std::string& text) {
    write_text(folder / "data.csv", text);
    return message_of([&] { (void)read_true_inertial_states(folder / "data.csv"); });
  };
  CHECK_THAT(error_of_truth("1,0,0,0,1,0,0,0\n"),
             Catch::Contains("data.csv:1: has 8 fields, but a ground truth with velocities has"));
  CHECK_THAT(error_of_truth("#t\n1,0,0,0,1,0,0,0,0,nan,0\n"),
             Catch::Contains("data.csv:2: has a field that is no"));
  CHECK_THAT(error_of_truth("1,0,0,0,1,1,1,1,0,0,0\n"), Catch::Contains("not of unit length"));
  const auto error_of_rows = [&](const std::string& text) {
    write_text(folder / "inertial.csv", text);
    return message_of([&] { (void)read_inertial(folder / "inertial.csv"); });
  };
  CHECK_THAT(error_of_rows(""), Catch::Contains("is not the inertial.csv of a run with --imu"));
  CHECK_THAT(error_of_rows("stamp_s,status\n"), Catch::Contains("is not the inertial.csv"));
  CHECK_THAT(error_of_rows("stamp_s,phase,vx_m_s\n1.0,running,2\n"),
             Catch::Contains("inertial.csv:2: is no stamp"));
}

TEST_CASE("The score of an IMU is a JSON object, and says when the truth has no biases",
          "[evaluation][imu]") {
  auto truth = true_states(20);
  const auto json =
      nlohmann::json::parse(inertial_score_json(score_inertial(estimates(20, 1.0), truth, 0.01)));
  CHECK(json["velocity_m_s"]["frames"] == 20);
  CHECK(json["biases"]["accelerometer_rms_m_s2"] > 0.0);
  CHECK(json["down"] == nlohmann::json({0.0, 1.0, 0.0}));
  CHECK_FALSE(json.contains("delay_s"));
  const auto with_delay =
      nlohmann::json::parse(inertial_score_json(score_inertial(estimates(20, 0.0), truth, 0.01, 0.014)));
  CHECK(with_delay["delay_s"]["frames"] == 20);
  CHECK(with_delay["delay_s"]["last_error"].get<double>() == Approx(0.001));
  for (auto& state : truth) state.biases.reset();
  std::ostringstream text;
  print_inertial_score(text, score_inertial(estimates(20, 1.0), truth, 0.01));
  CHECK_THAT(text.str(), Catch::Contains("n/a (the ground truth has none)"));
}
