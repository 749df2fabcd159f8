// SPDX-License-Identifier: MIT
#include "stereo_slam/evaluation/evaluate.hpp"

#include <numbers>
#include <random>
#include <sstream>

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

using Poses = std::vector<Eigen::Isometry3d>;

/// A drive with bends and hills, `step_m` a frame.
Poses drive(std::size_t frames, double step_m) {
  Poses poses{Eigen::Isometry3d::Identity()};
  while (poses.size() < frames) {
    const auto k = static_cast<double>(poses.size());
    const Eigen::Isometry3d motion = Eigen::AngleAxisd(0.01 * std::sin(0.03 * k), Eigen::Vector3d::UnitY()) *
                                     Eigen::AngleAxisd(0.002 * std::cos(0.05 * k), Eigen::Vector3d::UnitX()) *
                                     Eigen::Translation3d(0.0, 0.0, step_m);
    poses.push_back(poses.back() * motion);
  }
  return poses;
}

Poses straight(std::size_t frames, double step_m) {
  Poses poses(frames, Eigen::Isometry3d::Identity());
  for (std::size_t i = 0; i < frames; ++i) poses[i].translation().z() = step_m * static_cast<double>(i);
  return poses;
}

Poses noisy(const Poses& poses, double sigma_m, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0.0, sigma_m);
  Poses moved = poses;
  for (auto& pose : moved)
    pose.translation() += Eigen::Vector3d(normal(random), normal(random), normal(random));
  return moved;
}

Poses moved_by(const Eigen::Isometry3d& T, const Poses& poses) {
  Poses moved;
  for (const auto& pose : poses) moved.push_back(T * pose);
  return moved;
}

const Eigen::Isometry3d kSomewhereElse =
    Eigen::Translation3d(30, -4, 7) * Eigen::AngleAxisd(2.8, Eigen::Vector3d(1, 2, -1).normalized());

Trajectory unstamped(Poses poses) { return {TrajectoryFormat::kKitti, {}, std::move(poses)}; }

}  // namespace

TEST_CASE("A perfect estimate has no error", "[evaluate]") {
  const auto truth = drive(300, 1.0);
  const auto evaluation = evaluate(unstamped(truth), unstamped(truth));
  REQUIRE(evaluation.kitti);
  CHECK(evaluation.kitti->t_rel_percent < 1e-10);
  CHECK(evaluation.kitti->r_rel_deg_per_100m < 1e-6);
  CHECK(evaluation.ate_aligned_m.max < 1e-10);
  CHECK(evaluation.ate_first_pose_m.max < 1e-10);
  CHECK(evaluation.rpe_frame->translation_m.max < 1e-10);
  CHECK(evaluation.rpe_10m->rotation_deg.max < 1e-5);
}

TEST_CASE(
    "A segment ends at the first frame beyond its length, and its error is divided by the nominal length",
    "[evaluate]") {
  // 2 m a frame: a segment of 100 m spans 51 frames (102 m > 100 m; 100 m itself is not beyond). An estimate
  // 1 % too long errs by 1.02 m on it, 1.02 %. 121 frames are 240 m: starts 0 .. 60 hold one of 100 m, starts
  // 0, 10 one of 200 m (202 m).
  const auto truth = straight(121, 2.0);
  const auto score = kitti_score(truth, straight(121, 2.02));
  REQUIRE(score);
  CHECK(score->segments == 7 + 2);
  CHECK(score->t_rel_percent == Approx((7 * 1.02 + 2 * 1.01) / 9).epsilon(1e-12));
  CHECK(score->r_rel_deg_per_100m < 1e-9);
}

TEST_CASE("A steady false turn shows in r_rel", "[evaluate]") {
  const auto truth = straight(160, 1.0);
  Poses estimate = truth;
  const double turn_rad = 1e-4;  // a frame
  for (std::size_t i = 0; i < estimate.size(); ++i) {
    estimate[i].linear() =
        Eigen::AngleAxisd(turn_rad * static_cast<double>(i), Eigen::Vector3d::UnitY()).toRotationMatrix();
  }
  const auto score = kitti_score(truth, estimate);
  REQUIRE(score);
  CHECK(score->r_rel_deg_per_100m == Approx(101 * turn_rad * 180 / std::numbers::pi).epsilon(1e-9));
}

TEST_CASE("A path shorter than a segment has no KITTI score", "[evaluate]") {
  const auto evaluation = evaluate(unstamped(straight(20, 1.0)), unstamped(straight(20, 1.1)));
  CHECK_FALSE(evaluation.kitti);
  std::ostringstream text;
  print_evaluation(text, evaluation);
  CHECK_THAT(text.str(), Catch::Contains("n/a (the path is shorter than 100 m)"));
}

TEST_CASE("Relative scores and the aligned ATE do not depend on where the estimate starts",
          "[evaluate][law]") {
  const auto truth = drive(400, 0.7);
  const auto estimate = noisy(truth, 0.05, 3);
  const auto a = evaluate(unstamped(truth), unstamped(estimate));
  const auto b = evaluate(unstamped(truth), unstamped(moved_by(kSomewhereElse, estimate)));
  CHECK(b.kitti->t_rel_percent == Approx(a.kitti->t_rel_percent).epsilon(1e-9));
  CHECK(b.kitti->r_rel_deg_per_100m == Approx(a.kitti->r_rel_deg_per_100m).margin(1e-6));
  CHECK(b.ate_aligned_m.rmse == Approx(a.ate_aligned_m.rmse).epsilon(1e-9));
  CHECK(b.ate_first_pose_m.rmse == Approx(a.ate_first_pose_m.rmse).epsilon(1e-9));
  CHECK(b.rpe_frame->translation_m.rmse == Approx(a.rpe_frame->translation_m.rmse).epsilon(1e-9));
}

TEST_CASE("Alignment finds the motion between two copies of a path, and no scale", "[evaluate]") {
  const auto truth = drive(100, 1.0);
  const auto found = align(truth, moved_by(kSomewhereElse, truth));
  CHECK((found.matrix() - kSomewhereElse.inverse().matrix()).norm() < 1e-9);
  auto larger = truth;
  for (auto& pose : larger) pose.translation() *= 1.5;
  CHECK(std::abs(align(truth, larger).linear().determinant() - 1.0) < 1e-12);
}

TEST_CASE("A pure error of the scale is in the path ratio, and not in the similarity-aligned ATE",
          "[evaluate]") {
  const auto truth = drive(300, 1.0);
  for (const double scale : {0.5, 0.97, 1.0, 1.02, 20.0}) {
    CAPTURE(scale);
    auto estimate = moved_by(kSomewhereElse, truth);
    for (auto& pose : estimate) pose.translation() *= scale;
    const auto evaluation = evaluate(unstamped(truth), unstamped(estimate));
    REQUIRE(evaluation.path_ratio);
    CHECK(*evaluation.path_ratio == Approx(scale).epsilon(1e-12));
    REQUIRE(evaluation.similarity_aligned);
    CHECK(evaluation.similarity_aligned->scale == Approx(1.0 / scale).epsilon(1e-12));
    CHECK(evaluation.similarity_aligned->ate_m.max < 1e-10);
    if (scale != 1.0) CHECK(evaluation.ate_aligned_m.rmse > 0.1);
  }
}

TEST_CASE("On a straight path the SE(3)-aligned ATE of a scale error is the spread times the error",
          "[evaluate]") {
  // Positions z = 0 .. n - 1 have the variance (n^2 - 1) / 12.
  const auto truth = straight(101, 1.0);
  const auto evaluation = evaluate(unstamped(truth), unstamped(straight(101, 1.02)));
  CHECK(evaluation.ate_aligned_m.rmse ==
        Approx(0.02 * std::sqrt((101.0 * 101.0 - 1.0) / 12.0)).epsilon(1e-9));
  CHECK(*evaluation.path_ratio == Approx(1.02).epsilon(1e-12));
  CHECK(evaluation.similarity_aligned->ate_m.max < 1e-10);
}

TEST_CASE("Alignment with scale never leaves a larger error than alignment without", "[evaluate][law]") {
  for (const unsigned seed : {1U, 2U, 3U, 4U}) {
    CAPTURE(seed);
    const auto truth = drive(60, 0.4);
    const auto evaluation = evaluate(unstamped(truth), unstamped(noisy(truth, 0.5, seed)));
    CHECK(evaluation.similarity_aligned->ate_m.rmse <= evaluation.ate_aligned_m.rmse);
  }
}

TEST_CASE("No similarity is found, and no ratio, where the camera stands still", "[evaluate]") {
  const auto still = moved_by(kSomewhereElse, straight(10, 0.0));
  const auto moving = straight(10, 1.0);
  CHECK_FALSE(align_with_scale(still, moving));
  CHECK_FALSE(align_with_scale(moving, still));
  CHECK_FALSE(align_with_scale(still, still));
  auto tiny = moving;
  for (auto& pose : tiny) pose.translation() *= 1e-300;  // its squares are zero
  CHECK_FALSE(align_with_scale(tiny, tiny));
  const Poses one(moving.begin(), moving.begin() + 1);
  CHECK_FALSE(align_with_scale(one, one));
  CHECK_FALSE(path_ratio(still, moving));
  CHECK(path_ratio(moving, still) == 0.0);

  std::ostringstream text;
  std::ostringstream json_text;
  const auto evaluation = evaluate(unstamped(still), unstamped(noisy(still, 0.01, 9)));
  print_evaluation(text, evaluation);
  CHECK_THAT(text.str(), Catch::Contains("ratio n/a (the camera stands still)") &&
                             Catch::Matches("[^]*similarity-aligned +n/a \\(the camera stands still\\)[^]*"));
  write_evaluation_json(json_text, evaluation);
  const auto json = nlohmann::json::parse(json_text.str());
  CHECK(json["path_ratio"].is_null());
  CHECK(json["similarity_aligned"].is_null());
  CHECK(json["segments_10_50_m"].is_null());
}

TEST_CASE("Two poses are aligned without an error by some similarity", "[evaluate]") {
  const auto truth = straight(2, 3.0);
  const auto estimate = moved_by(kSomewhereElse, straight(2, 2.0));
  const auto error = similarity_aligned_error(truth, estimate);
  REQUIRE(error);
  CHECK(error->scale == Approx(1.5).epsilon(1e-12));
  CHECK(error->ate_m.max < 1e-12);
  CHECK(*path_ratio(truth, estimate) == Approx(2.0 / 3.0).epsilon(1e-12));
}

TEST_CASE("Segments of 10 to 50 m score paths that are too short for the KITTI score", "[evaluate]") {
  // 1 m a frame: a segment of L m spans L + 1 frames, so a path 1 % too long errs by (L + 1) / L per cent. 35
  // frames are 34 m: starts 0, 10, 20 hold one of 10 m (to 11, 21, 31), starts 0, 10 one of 20 m, start 0 one
  // of 30 m.
  const auto evaluation = evaluate(unstamped(straight(35, 1.0)), unstamped(straight(35, 1.01)));
  CHECK_FALSE(evaluation.kitti);
  REQUIRE(evaluation.segments_10_50_m);
  CHECK(evaluation.segments_10_50_m->segments == 6);
  CHECK(evaluation.segments_10_50_m->t_rel_percent ==
        Approx((3 * 11.0 / 10.0 + 2 * 21.0 / 20.0 + 31.0 / 30.0) / 6.0).epsilon(1e-9));
}

TEST_CASE("No rigid motion beats the alignment", "[evaluate][law]") {
  const auto truth = drive(100, 1.0);
  const auto estimate = noisy(truth, 0.3, 5);
  const auto T = align(truth, estimate);
  const double best = absolute_trajectory_error(truth, estimate, T).rmse;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double step : {-1e-3, 1e-3}) {
      const Eigen::Vector3d direction = Eigen::Vector3d::Unit(axis);
      CHECK(absolute_trajectory_error(truth, estimate, T * Eigen::Translation3d(step * direction)).rmse >
            best);
      CHECK(absolute_trajectory_error(truth, estimate, T * Eigen::AngleAxisd(step, direction)).rmse > best);
    }
  }
}

TEST_CASE("A camera at a standstill can be evaluated", "[evaluate]") {
  const auto truth = straight(10, 0.0);
  const auto evaluation = evaluate(unstamped(truth), unstamped(noisy(truth, 0.01, 9)));
  CHECK(std::isfinite(evaluation.ate_aligned_m.rmse));
  CHECK_FALSE(evaluation.rpe_10m);
}

TEST_CASE("The median of an even number of errors is the mean of the middle two", "[evaluate]") {
  const auto statistics = error_statistics({4.0, 1.0, 2.0, 9.0});
  CHECK(statistics.median == 3.0);
  CHECK(statistics.mean == 4.0);
  CHECK(statistics.max == 9.0);
  CHECK(statistics.rmse == Approx(std::sqrt(102.0 / 4.0)));
  CHECK(error_statistics({4.0, 1.0, 9.0}).median == 4.0);
  CHECK_THROWS_AS(error_statistics({}), std::invalid_argument);
}

TEST_CASE("Pairs along the path begin where its first stretch ends and do not overlap", "[evaluate]") {
  const FramePairs expected = {{3, 6}, {6, 9}};
  CHECK(pairs_by_distance(straight(12, 4.0), 10.0) == expected);
  CHECK(pairs_by_distance(straight(3, 4.0), 10.0).empty());
  CHECK(pairs_by_distance({}, 10.0).empty());
  CHECK(consecutive_pairs(3) == FramePairs{{0, 1}, {1, 2}});
  CHECK(consecutive_pairs(0).empty());
}

TEST_CASE("Each pose of the shorter list takes the nearest of the longer one within the allowed difference",
          "[evaluate]") {
  const std::vector<std::int64_t> truth = {0, 10, 20, 30, 40};
  const std::vector<std::int64_t> estimate = {-7, 9, 26, 43, 60};
  CHECK(associate_by_stamp(truth, estimate, 7) == FramePairs{{0, 0}, {1, 1}, {3, 2}, {4, 3}});
  CHECK(associate_by_stamp(truth, std::vector<std::int64_t>{9, 26, 60}, 7) == FramePairs{{1, 0}, {3, 1}});
  CHECK(associate_by_stamp(truth, {}, 7).empty());
}

TEST_CASE("Stamps are matched across an offset of half a frame only if allowed", "[evaluate]") {
  Trajectory truth{TrajectoryFormat::kTum, {}, straight(50, 1.0)};
  Trajectory estimate = truth;
  for (std::int64_t i = 0; i < 50; ++i) {
    truth.stamps_ns.push_back(100'000'000 * i);
    estimate.stamps_ns.push_back(100'000'000 * i + 15'000'000);
  }
  CHECK(evaluate(truth, estimate, 0.02).matched == 50);
  CHECK_THAT(message_of([&] { (void)evaluate(truth, estimate, 0.01); }),
             Catch::Contains("only 0 of 50 estimated poses match") &&
                 Catch::Contains("the nearest stamps are 0.015000000 s apart, and --max-time-difference is "
                                 "0.01 s: check both clocks"));
}

TEST_CASE("Stamps that do not overlap are named, with the time between them", "[evaluate]") {
  Trajectory truth{TrajectoryFormat::kTum, {}, straight(5, 1.0)};
  Trajectory estimate = truth;
  for (std::int64_t i = 0; i < 5; ++i) {
    truth.stamps_ns.push_back(1'403'636'579'500'000'000 + 100'000'000 * i);
    estimate.stamps_ns.push_back(100'000'000 * i);
  }
  CHECK_THAT(message_of([&] { (void)evaluate(truth, estimate); }),
             Catch::Contains(
                 "ground truth: 1403636579.500000000 to 1403636579.900000000 s, estimate: 0.000000000 to "
                 "0.400000000 s, which is 1403636579.100000000 s apart"));
}

TEST_CASE("Poses without stamps are matched by the numbers of their frames", "[evaluate]") {
  Trajectory truth = unstamped(straight(10, 1.0));
  truth.frames = {0, 1, 2, 4, 5, 6, 9, 10, 11, 12};  // the poses of 3, 7 and 8 are missing
  CHECK(match_poses(truth, unstamped(straight(10, 1.0))) ==
        FramePairs{{0, 0}, {1, 1}, {2, 2}, {3, 4}, {4, 5}, {5, 6}, {6, 9}});
}

TEST_CASE("Trajectories that cannot be matched are refused", "[evaluate]") {
  Trajectory stamped{TrajectoryFormat::kTum, {0, 1, 2, 3}, straight(4, 1.0)};
  CHECK_THAT(message_of([&] { (void)evaluate(stamped, unstamped(straight(4, 1.0))); }),
             Catch::Contains("only one of the two trajectories has stamps"));
  CHECK_THAT(message_of([&] { (void)evaluate(unstamped(straight(2, 1.0)), unstamped(straight(4, 1.0))); }),
             Catch::Contains("3 are needed"));
}

TEST_CASE("An estimate that stops early is scored on the part that it covers", "[evaluate]") {
  const auto evaluation = evaluate(unstamped(straight(100, 1.0)), unstamped(straight(60, 1.0)));
  CHECK(evaluation.matched == 60);
  CHECK(evaluation.truth_length_m == Approx(59.0));
}

TEST_CASE("The JSON report holds the same figures, and null for scores that do not exist", "[evaluate]") {
  for (const std::size_t frames : {40U, 300U}) {
    const auto truth = drive(frames, 1.0);
    const auto evaluation = evaluate(unstamped(truth), unstamped(noisy(truth, 0.1, 1)));
    std::ostringstream text;
    write_evaluation_json(text, evaluation);
    const auto json = nlohmann::json::parse(text.str());
    CHECK(json["frames_matched"] == frames);
    CHECK(json["ate_se3_aligned_m"]["rmse"] == evaluation.ate_aligned_m.rmse);
    CHECK(json["path_ratio"] == *evaluation.path_ratio);
    CHECK(json["similarity_aligned"]["scale"] == evaluation.similarity_aligned->scale);
    CHECK(json["similarity_aligned"]["ate_m"]["rmse"] == evaluation.similarity_aligned->ate_m.rmse);
    CHECK(json["segments_10_50_m"]["t_rel_percent"] == evaluation.segments_10_50_m->t_rel_percent);
    CHECK(json["rpe_10_m"]["rotation_deg"]["median"] == evaluation.rpe_10m->rotation_deg.median);
    CHECK(json["kitti"].is_null() == (frames == 40));
    if (evaluation.kitti) CHECK(json["kitti"]["t_rel_percent"] == evaluation.kitti->t_rel_percent);
  }
}
