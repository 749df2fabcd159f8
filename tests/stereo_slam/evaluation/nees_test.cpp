// SPDX-License-Identifier: MIT
#include "stereo_slam/evaluation/nees.hpp"

#include <random>
#include <regex>
#include <sstream>

#include <Eigen/Cholesky>

#include "stereo_slam/core/pose_estimate.hpp"
#include "stereo_slam/io/covariance_columns.hpp"
#include "stereo_slam/io/text_file.hpp"
#include "stereo_slam/results/output.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

constexpr std::size_t kFramesPerKeyframe = 5;

/// A drive whose estimate errs as its covariances say, relative to a keyframe every five frames.
struct HonestRun {
  Trajectory truth, estimate;
  FramePairs pairs;
  std::vector<CovarianceRow> rows;

  explicit HonestRun(std::size_t frames) {
    std::mt19937_64 random(1);
    std::normal_distribution<double> normal;
    Vector6<double> step;
    step << 0.01, 0.02, -0.01, 0.1, 0.0, 1.0;
    Vector6<double> sigma;
    sigma << 1e-3, 2e-3, 1e-3, 0.01, 0.02, 0.03;
    std::vector<Pose> true_poses{Pose::identity()}, poses{Pose::identity()};
    rows.push_back({0, Matrix6<double>::Zero(), 0.0, 0});
    for (std::size_t k = 1; k < frames; ++k) {
      const std::size_t keyframe = (k - 1) / kFramesPerKeyframe * kFramesPerKeyframe;
      Vector6<double> error;
      for (double& e : error) e = normal(random);
      true_poses.push_back(true_poses.back() * Pose::exp(step));
      const Pose relative = true_poses[keyframe].inverse() * true_poses[k];
      poses.push_back(poses[keyframe] * relative.boxplus(sigma.cwiseProduct(error)));
      rows.push_back({keyframe, sigma.cwiseAbs2().asDiagonal(), 30.0, 30});
    }
    for (std::size_t k = 0; k < frames; ++k) {
      truth.poses.push_back(true_poses[k].isometry());
      estimate.poses.push_back(poses[k].isometry());
      pairs.emplace_back(k, k);
    }
  }
};

}  // namespace

TEST_CASE("Correct covariances give a mean NEES of six", "[nees]") {
  const HonestRun run(5001);
  const auto score = score_covariances(run.truth, run.estimate, run.pairs, run.rows, {});
  REQUIRE(score.relative.size() == 3);
  for (const auto& relative : score.relative) {
    CAPTURE(relative.frames);
    CHECK(relative.count >= 980);
    // Starts five frames apart: over 10 and 100 frames 2 and 20 of them share their errors.
    const std::size_t shared = 1 + relative.frames / kFramesPerKeyframe;
    const double independent = static_cast<double>(relative.count) / static_cast<double>(shared);
    CHECK(std::abs(relative.mean - 6.0) <= 4.0 * std::sqrt(12.0 / independent));
    CHECK(relative.share_inside > 0.88);
  }
  CHECK(score.mean_nis_per_dof == Approx(1.0));
  CHECK(score.updates == 5000);
}

TEST_CASE("The noise of the ground truth is added to the covariance", "[nees]") {
  HonestRun run(501);
  for (auto& row : run.rows) row.relative *= 1e-4;
  const auto strict = score_covariances(run.truth, run.estimate, run.pairs, run.rows, {});
  const auto lenient = score_covariances(run.truth, run.estimate, run.pairs, run.rows, {0.1, 0.01});
  CHECK(strict.relative[1].share_inside < 0.1);
  CHECK(lenient.relative[1].share_inside > 0.99);
}

TEST_CASE("An error of the scale is common to all frames", "[nees]") {
  HonestRun run(501);
  for (auto& pose : run.estimate.poses) pose.translation() *= 1.02;
  const auto unaware = score_covariances(run.truth, run.estimate, run.pairs, run.rows, {});
  for (auto& row : run.rows) row.calibration.scale_sigma = 0.02;
  const auto aware = score_covariances(run.truth, run.estimate, run.pairs, run.rows, {});
  CHECK(unaware.relative[2].share_inside < 0.5);
  CHECK(aware.relative[2].share_inside > 0.88);
}

TEST_CASE("An error of the camera's axes is common to all frames", "[nees]") {
  HonestRun run(501);
  const Eigen::Isometry3d X(Eigen::AngleAxisd(0.02, Eigen::Vector3d(0.6, 0.8, 0.0)));
  for (auto& pose : run.estimate.poses) pose = X * pose * X.inverse();
  const auto unaware = score_covariances(run.truth, run.estimate, run.pairs, run.rows, {});
  for (auto& row : run.rows) row.calibration.axes_sigma_rad = 0.02;
  const auto aware = score_covariances(run.truth, run.estimate, run.pairs, run.rows, {});
  CHECK(unaware.relative[2].share_inside < 0.5);
  CHECK(aware.relative[2].share_inside > 0.88);
}

TEST_CASE("Motions that end at a keyframe have a common error, others have none", "[nees]") {
  constexpr double kCommon_rad = 2e-3;
  const Matrix6<double> P = 1e-6 * Matrix6<double>::Identity();
  Vector6<double> step, error;
  step << 0.0, 0.0, 0.0, 0.0, 0.0, 1.0;
  error << 1e-3, 0.0, 0.0, 0.0, 0.0, 0.0;
  Trajectory truth, estimate;
  FramePairs pairs;
  Pose T_true, T_estimate;
  for (std::size_t k = 0; k < 3; ++k) {  // keyframes 0 and 1; frame 2 is none
    truth.poses.push_back(T_true.isometry());
    estimate.poses.push_back(T_estimate.isometry());
    pairs.emplace_back(k, k);
    T_true = T_true * Pose::exp(step);
    T_estimate = T_estimate * Pose::exp(step).boxplus(error);
  }
  std::vector<CovarianceRow> rows = {
      {0, Matrix6<double>::Zero(), 0.0, 0}, {0, P, 30.0, 30}, {1, P, 30.0, 30}};
  for (auto& row : rows) row.calibration.common_error_rad = kCommon_rad;
  const auto score = score_covariances(truth, estimate, pairs, rows, {});
  REQUIRE(score.relative[0].count == 2);
  const double own = 1e-6, with_common = own + kCommon_rad * kCommon_rad;
  CHECK(score.relative[0].mean == Approx(0.5 * (1e-6 / with_common + 1e-6 / own)).epsilon(1e-3));
}

TEST_CASE("An error that all links have in common adds up over them", "[nees]") {
  constexpr double kSigma_rad = 7e-4;  // half of a link's own error
  HonestRun run(501);
  const auto measured = run.estimate.poses;
  Vector6<double> factors;
  factors << 1.0, -0.8, 1.2, -1.0, 0.6, 1.0;
  for (std::size_t k = 1; k < measured.size(); ++k) {
    const auto& row = run.rows[k];
    const Pose link = Pose::from_isometry(measured[row.keyframe].inverse() * measured[k]);
    const Vector6<double> error =
        kSigma_rad * factors.cwiseProduct(common_error_per_rad({link, row.relative}));
    const bool keyframe = k % kFramesPerKeyframe == 0;
    run.estimate.poses[k] =
        run.estimate.poses[row.keyframe] * (keyframe ? link.boxplus(error) : link).isometry();
  }
  const auto unaware = score_covariances(run.truth, run.estimate, run.pairs, run.rows, {});
  for (auto& row : run.rows) row.calibration.common_error_rad = kSigma_rad;
  const auto aware = score_covariances(run.truth, run.estimate, run.pairs, run.rows, {});
  CHECK(unaware.relative[2].share_inside < 0.5);
  CHECK(aware.relative[0].mean == unaware.relative[0].mean);  // from a keyframe to the next frame: no link
  CHECK(aware.relative[2].share_inside > 0.88);
}

TEST_CASE("The NEES in the world compares every pose with the first, once for each", "[nees]") {
  constexpr int kRuns = 300;
  std::mt19937_64 random(2);
  std::normal_distribution<double> normal;
  Vector6<double> sigma;
  sigma << 1e-3, 2e-3, 1e-3, 0.1, 0.2, 0.3;
  const Pose T_truth_world = Pose::from_matrix(Eigen::Matrix3d::Identity(), Eigen::Vector3d(5.0, -3.0, 1.0));
  TrackedRun run;
  run.rows.resize(kRuns);
  for (std::size_t k = 0; k < kRuns; ++k) {
    Vector6<double> error;
    for (double& e : error) e = k == 0 ? 0.0 : normal(random);
    const Pose pose =
        Pose::from_matrix(Eigen::Matrix3d::Identity(), Eigen::Vector3d(0.0, 0.0, static_cast<double>(k)));
    run.poses.push_back(pose);
    run.true_poses.emplace_back(T_truth_world * pose.boxplus(sigma.cwiseProduct(error)));
    run.rows[k].in_world = (k == 0 ? 1e-10 : 1.0) * Matrix6<double>(sigma.cwiseAbs2().asDiagonal());
  }
  const auto mean = [&] {
    double sum = 0.0;
    for (const auto& nees : world_nees(run, {})) sum += nees.value / (kRuns - 1);
    return sum;
  };
  CHECK(world_nees(run, {}).size() == kRuns - 1);
  CHECK(mean() == Approx(6.0).margin(4.0 * std::sqrt(12.0 / kRuns)));
  for (auto& row : run.rows) row.in_world *= 0.25;
  CHECK(mean() == Approx(24.0).margin(16.0 * std::sqrt(12.0 / kRuns)));
  run.true_poses[7].reset();
  CHECK(world_nees(run, {}).size() == kRuns - 2);
  run.rows[0].in_world = Matrix6<double>::Identity();  // a run that continues in a loaded map
  CHECK(world_nees(run, {}).empty());
  CHECK(world_nees({}, {}).empty());
}

TEST_CASE("A covariance that is not positive definite is refused", "[nees]") {
  for (const double factor : {0.0, -1.0}) {
    HonestRun run(101);
    for (std::size_t k = 51; k < run.rows.size(); ++k) run.rows[k].relative *= factor;
    CHECK_THAT(message_of([&] { (void)score_covariances(run.truth, run.estimate, run.pairs, run.rows, {}); }),
               Catch::Contains("is not positive definite"));
  }
}

TEST_CASE("Covariances that are all zero are refused, also if the ground truth has errors", "[nees]") {
  HonestRun run(10);
  for (auto& row : run.rows) row.relative.setZero();
  CHECK_THAT(message_of([&] {
               (void)score_covariances(run.truth, run.estimate, run.pairs, run.rows, {0.03, 0.002});
             }),
             Catch::Contains("all covariances of relative poses are zero"));
}

TEST_CASE("Relative poses without ground truth are left out", "[nees]") {
  HonestRun run(30);
  run.pairs.erase(run.pairs.begin() + 15);
  const auto score = score_covariances(run.truth, run.estimate, run.pairs, run.rows, {});
  CHECK(score.relative[0].count == 5);  // of the starts 0, 5 .. 25 all but 15
  CHECK(score.relative[1].count == 2);  // 0 and 10; 5 ends at the missing one and 15 starts there
  CHECK(score.relative[2].count == 0);
  std::ostringstream text;
  print_nees(text, score);
  CHECK_THAT(text.str(), Catch::Contains("NEES over 100 frames") && Catch::Contains("n/a"));
}

TEST_CASE("Only a ground truth without noise draws a hint", "[nees]") {
  const HonestRun run(30);
  const auto printed = [&](const GroundTruthNoise& noise) {
    std::ostringstream text;
    print_nees(text, score_covariances(run.truth, run.estimate, run.pairs, run.rows, noise));
    return text.str();
  };
  CHECK_THAT(printed({}), Catch::Contains("hint: the ground truth is taken as exact"));
  CHECK_THAT(printed({.translation_m = 0.03}), !Catch::Contains("hint"));
  CHECK_THAT(printed({.rotation_rad = 0.002}), !Catch::Contains("hint"));
}

TEST_CASE("evaluate reads covariances.csv as run writes it", "[nees]") {
  const TemporaryFolder folder;
  RunRecord record;
  record.results.resize(3);
  record.trajectory.resize(3);
  for (std::size_t k = 0; k < 3; ++k) {
    record.results[k].keyframe = k / 2;
    record.results[k].nis = 1.5 * static_cast<double>(k);
    record.results[k].nis_dof = static_cast<int>(k);
    const auto number = static_cast<double>(k);
    record.results[k].calibration = {0.25 * number, 0.125 * number, 0.0625 * number};
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j < 6; ++j)
        record.results[k].relative_covariance(i, j) = i * j + static_cast<double>(k);
      for (int j = 0; j < 6; ++j) record.trajectory[k].covariance(i, j) = i + j + static_cast<double>(k);
    }
  }
  std::ostringstream out;
  write_covariances(out, record);
  write_text(folder / "covariances.csv", out.str());
  const auto rows = read_covariances(folder / "covariances.csv");
  REQUIRE(rows.size() == 3);
  for (std::size_t k = 0; k < 3; ++k) {
    CHECK(rows[k].keyframe == record.results[k].keyframe);
    CHECK(rows[k].relative == record.results[k].relative_covariance);
    CHECK(rows[k].in_world == record.trajectory[k].covariance);
    CHECK(rows[k].nis == record.results[k].nis);
    CHECK(rows[k].nis_dof == record.results[k].nis_dof);
    CHECK(rows[k].calibration.scale_sigma == record.results[k].calibration.scale_sigma);
    CHECK(rows[k].calibration.axes_sigma_rad == record.results[k].calibration.axes_sigma_rad);
    CHECK(rows[k].calibration.common_error_rad == record.results[k].calibration.common_error_rad);
  }
}

TEST_CASE("evaluate reads a covariances.csv with reasons, and one of before that column", "[nees]") {
  const TemporaryFolder folder;
  RunRecord record;
  record.results.resize(2);
  record.trajectory.resize(2);
  record.results[0].nis = 2.5;
  record.results[1].weak = {.few_landmarks = true, .segment_not_localised = true};
  std::ostringstream out;
  write_covariances(out, record);
  const auto file = folder / "covariances.csv";
  const std::string text = out.str();
  write_text(file, text);
  CHECK(read_covariances(file).size() == 2);
  const std::string earlier = std::regex_replace(text, std::regex(",[^,\n]*\n"), "\n");
  write_text(file, earlier);
  const auto rows = read_covariances(file);
  REQUIRE(rows.size() == 2);
  CHECK(rows[0].nis == 2.5);
  const auto refusal = [&](const std::string& with_fault) {
    write_text(file, with_fault);
    return message_of([&] { (void)read_covariances(file); });
  };
  CHECK_THAT(refusal(std::regex_replace(text, std::regex("few_"), "few ")),
             Catch::Contains("covariances.csv:3: 'few landmarks' in the column reasons is none of: "
                             "odometry_alone, imu_alone, imu_contradicted, few_landmarks, "));
  CHECK_THAT(refusal(std::regex_replace(text, std::regex("localised"), "")),
             Catch::Contains("covariances.csv:3: 'segment_not_' in the column reasons is none of"));
  CHECK_THAT(refusal(std::regex_replace(text, std::regex("segment_not_localised"), "")),
             Catch::Contains("covariances.csv:3: '' in the column reasons is none of"));
  CHECK_THAT(refusal(text.substr(0, text.size() - 5)), Catch::Contains("covariances.csv:3: the last line"));
  for (const std::string cut : {"reason", "r", ""}) {
    CHECK_THAT(
        refusal(std::regex_replace(text, std::regex("reasons"), cut)),
        Catch::Contains("covariances.csv:1: the names of the columns are cut off after '" + cut + "'"));
  }
  CHECK_THAT(refusal(covariance_columns() + earlier.substr(earlier.find('\n'))),
             Catch::Contains("covariances.csv:2: expected stamp, status and 48 numbers before the reasons"));
  CHECK_THAT(refusal(earlier.substr(0, earlier.find('\n')) + text.substr(text.find('\n'))),
             Catch::Contains("covariances.csv:3: expected stamp, status and 48 numbers, not 51 fields"));
}

TEST_CASE("Stamps of the same frame differ by a microsecond at most", "[nees]") {
  CHECK(is_same_stamp(1'403'715'273'262'142'976, 1'403'715'273'262'143'976));
  CHECK_FALSE(is_same_stamp(1'403'715'273'262'143'977, 1'403'715'273'262'142'976));
  CHECK_FALSE(is_same_stamp(4'000'000'000'000'000'000, -4'000'000'000'000'000'000));
  HonestRun run(3);
  for (std::int64_t k = 0; k < 3; ++k) run.estimate.stamps_ns.push_back(k * 100'000'000);
  const auto refusal = [&] {
    return message_of([&] { (void)score_covariances(run.truth, run.estimate, run.pairs, run.rows, {}); });
  };
  CHECK(refusal().empty());  // rows without stamps
  for (std::size_t k = 0; k < 3; ++k) run.rows[k].stamp_ns = run.estimate.stamps_ns[k] + 400;
  CHECK(refusal().empty());
  run.rows[2].stamp_ns = 0;
  CHECK_THAT(refusal(),
             Catch::Contains("the stamp of frame 2 is 0.000000000 s in the one and 0.200000000 s"));
}

TEST_CASE("Impossible values are refused with their line", "[nees]") {
  const TemporaryFolder folder;
  const auto refusal = [&](const FrameResult& result) {
    RunRecord record;
    record.results = {result};
    record.trajectory.resize(1);
    std::ostringstream out;
    write_covariances(out, record);
    write_text(folder / "covariances.csv", out.str());
    return message_of([&] { (void)read_covariances(folder / "covariances.csv"); });
  };
  CHECK(refusal({}).empty());
  const std::string text = read_text(folder / "covariances.csv");
  write_text(folder / "covariances.csv", std::regex_replace(text, std::regex("INITIALIZING"), "FINE"));
  CHECK_THAT(message_of([&] { (void)read_covariances(folder / "covariances.csv"); }),
             Catch::Contains("covariances.csv:2: \"FINE\" is not a status"));
  FrameResult odd;
  odd.calibration.axes_sigma_rad = 1e200;
  CHECK_THAT(refusal(odd), Catch::Contains("covariances.csv:2: degrees of freedom and standard deviations"));
  odd.calibration = {-0.1, 0.0, 0.0};
  CHECK_THAT(refusal(odd), Catch::Contains("covariances.csv:2: degrees of freedom and standard deviations"));
}

TEST_CASE("Another file, or that of another run, is refused with its name", "[nees]") {
  const TemporaryFolder folder;
  const auto file = folder / "covariances.csv";
  write_text(file, "1 2 3\n");
  CHECK_THAT(message_of([&] { (void)read_covariances(file); }), Catch::Contains("covariances.csv"));
  write_text(file, "stamp_s,status,drift_sigma_rad,rest\n");  // as versions before this column wrote it
  CHECK_THAT(message_of([&] { (void)read_covariances(file); }), Catch::Contains("not those of this version"));
  std::string columns = covariance_columns();
  write_text(file, columns + "\n0.0,OK,1,2,nan\n");
  CHECK_THAT(message_of([&] { (void)read_covariances(file); }), Catch::Contains("covariances.csv:2"));
  const auto count = std::count(columns.begin(), columns.end(), ',');
  std::string row = "0.0,OK";
  for (auto i = count; i > 3; --i) row += ",0";
  write_text(file, columns + "\n" + row + ",nan,\n");
  CHECK_THAT(message_of([&] { (void)read_covariances(file); }),
             Catch::Contains("covariances.csv:2") && Catch::Contains("'nan' is not a finite number"));
  write_text(file, "status,stamp_s" + columns.substr(columns.find(",rx_rx")) + "\n");
  CHECK_THAT(message_of([&] { (void)read_covariances(file); }), Catch::Contains("in another order"));
  columns.replace(columns.find("rx_ry_rad2"), 10, "rx_ry_deg2");
  write_text(file, columns + "\n");
  CHECK_THAT(message_of([&] { (void)read_covariances(file); }), Catch::Contains("not those of this version"));
  const HonestRun run(10);
  CHECK_THAT(message_of([&] {
               (void)score_covariances(run.truth, run.estimate, run.pairs, {run.rows[0], run.rows[1]}, {});
             }),
             Catch::Contains("2 rows of covariances for 10 estimated poses"));
}
