// SPDX-License-Identifier: MIT
#include "stereo_slam/evaluation/loop_score.hpp"

#include <cmath>
#include <numbers>
#include <sstream>

#include <nlohmann/json.hpp>

#include "stereo_slam/results/output.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

constexpr std::size_t kLap = 100;  // frames, of one metre

/// Drives in a circle of a hundred metres, looking ahead.
Eigen::Isometry3d on_circle(double path_m) {
  const double angle = path_m / static_cast<double>(kLap) * 2.0 * std::numbers::pi;
  const double radius_m = static_cast<double>(kLap) / (2.0 * std::numbers::pi);
  return Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()) * Eigen::Translation3d(-radius_m, 0.0, 0.0);
}

TruePoses laps(std::size_t frames) {
  TruePoses poses;
  for (std::size_t k = 0; k < frames; ++k) poses.emplace_back(on_circle(static_cast<double>(k)));
  return poses;
}

TruePoses straight_path(std::size_t frames, double step_m) {
  TruePoses poses;
  for (std::size_t k = 0; k < frames; ++k)
    poses.emplace_back(Eigen::Translation3d(0.0, 0.0, step_m * static_cast<double>(k)));
  return poses;
}

/// A loop of the laps that measures what is true.
LoopEvent loop(std::size_t frame, std::size_t old_frame, bool accepted = true) {
  const Eigen::Isometry3d T_old_new =
      on_circle(static_cast<double>(old_frame)).inverse() * on_circle(static_cast<double>(frame));
  return {.frame = frame,
          .old_frame = old_frame,
          .inliers = 50,
          .chi2 = 3.5,
          .accepted = accepted,
          .T_old_new = Pose::from_isometry(T_old_new)};
}

/// One that takes the other side of the circle for this one.
LoopEvent false_loop(std::size_t frame, std::size_t old_frame, bool accepted = true) {
  LoopEvent result = loop(frame, old_frame, accepted);
  result.T_old_new = Pose::identity();
  return result;
}

}  // namespace

TEST_CASE("A second lap is one revisit, from five metres before its beginning", "[loop_score]") {
  const auto revisits = find_revisits(laps(180), {});
  REQUIRE(revisits.size() == 1);
  CHECK(revisits[0].first == kLap - 5);
  CHECK(revisits[0].last == 179);
  CHECK(revisits[0].path_m == Approx(84.0).epsilon(1e-3));  // chords of one-metre arcs
}

TEST_CASE("Standing, creeping and driving on are no revisits", "[loop_score]") {
  CHECK(find_revisits(straight_path(300, 0.0), {}).empty());
  CHECK(find_revisits(straight_path(300, 0.02), {}).empty());
  CHECK(find_revisits(straight_path(300, 1.0), {}).empty());
  CHECK(find_revisits({}, {}).empty());
}

TEST_CASE("Noise of the ground truth at a standstill makes no revisit", "[loop_score]") {
  auto poses = straight_path(300, 0.0);  // 0.1 m to and fro: 30 m
  for (std::size_t k = 0; k < poses.size(); k += 2) poses[k]->translation().x() = 0.1;
  CHECK(find_revisits(poses, {}).empty());
}

TEST_CASE("The same street in the opposite direction is no revisit", "[loop_score]") {
  auto poses = straight_path(200, 1.0);
  for (std::size_t k = 100; k < 200; ++k) {
    *poses[k] = Eigen::Translation3d(0.0, 0.0, 200.0 - static_cast<double>(k)) *
                Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitY());
  }
  CHECK(find_revisits(poses, {}).empty());
}

TEST_CASE("A revisit needs the minimum gap in frames", "[loop_score]") {
  CHECK(find_revisits(laps(180), {.min_gap_frames = 120}).empty());
  CHECK(find_revisits(laps(180), {.min_gap_frames = 96}).front().first == 96);
}

TEST_CASE("Short gaps in a revisit are bridged; long ones divide it", "[loop_score]") {
  auto poses = laps(180);
  const auto shift = [&](std::size_t first, std::size_t count) {
    for (std::size_t k = first; k < first + count; ++k) poses[k]->translation().y() += 8.0;
  };
  shift(120, 5);
  CHECK(find_revisits(poses, {}).size() == 1);
  shift(150, 6);
  const auto revisits = find_revisits(poses, {});
  REQUIRE(revisits.size() == 2);
  CHECK(revisits[0].last == 149);
  CHECK(revisits[1].first == 156);
}

TEST_CASE("A loop is true if its relative pose agrees with the ground truth", "[loop_score]") {
  auto truth = laps(180);
  truth[130].reset();
  const auto score = score_loops(truth, {loop(110, 10), false_loop(112, 60), loop(115, 14, false),
                                         false_loop(116, 60, false), loop(130, 30), loop(120, 40)});
  CHECK(score.accepted == 4);
  CHECK(score.accepted_false == 1);  // the other side of the circle
  CHECK(score.refused == 2);
  CHECK(score.refused_true == 1);
  CHECK(score.without_truth == 1);
}

TEST_CASE("A true loop is off by at most two metres and five degrees", "[loop_score]") {
  const auto is_true = [](const Vector3<double>& offset_m, double turn_deg) {
    LoopEvent event = loop(110, 10);
    const Eigen::AngleAxisd turn(turn_deg / 180.0 * std::numbers::pi, Eigen::Vector3d::UnitX());
    event.T_old_new = event.T_old_new * Pose::from_matrix(turn.toRotationMatrix(), offset_m);
    return score_loops(laps(180), {event}).accepted_false == 0;
  };
  CHECK(is_true({0.0, 0.0, 1.99}, 0.0));
  CHECK_FALSE(is_true({0.0, 2.01, 0.0}, 0.0));
  CHECK(is_true({0.0, 0.0, 0.0}, 4.9));
  CHECK_FALSE(is_true({0.0, 0.0, 0.0}, 5.1));
}

TEST_CASE("A loop finds the revisit of its frame and the next twenty frames of it", "[loop_score]") {
  const auto score = score_loops(laps(180), {loop(110, 10), loop(120, 20), loop(179, 79)});
  CHECK(revisits_found(score) == 1);
  CHECK(median_delay_frames(score) == 110.0 - 95.0);
  // The steps to frames 110 to 140 and to 179, of 84.
  CHECK(score.revisits[0].found_path_m == Approx(32.0).epsilon(1e-3));
  CHECK(path_recall(score).value() == Approx(32.0 / 84.0));
}

TEST_CASE("A false or a refused loop finds nothing", "[loop_score]") {
  const auto score = score_loops(laps(180), {false_loop(110, 60), loop(112, 12, false)});
  CHECK(revisits_found(score) == 0);
  CHECK(path_recall(score) == 0.0);
  CHECK_FALSE(median_delay_frames(score));
}

TEST_CASE("The delay is the median over the revisits found", "[loop_score]") {
  auto truth = laps(180);
  for (std::size_t k = 140; k < 150; ++k) truth[k]->translation().y() += 8.0;
  const auto score = score_loops(truth, {loop(105, 5), loop(156, 56), loop(170, 70)});
  REQUIRE(score.revisits.size() == 2);
  CHECK(median_delay_frames(score) == (10.0 + 6.0) / 2.0);
}

TEST_CASE("A path without revisits has no recall", "[loop_score]") {
  const auto score = score_loops(straight_path(100, 1.0), {});
  CHECK_FALSE(path_recall(score));
  std::ostringstream text;
  print_loop_score(text, score);
  CHECK_THAT(text.str(),
             Catch::Contains("0 accepted") && Catch::Contains("revisits                        none"));
  const auto json = nlohmann::json::parse(loop_score_json(score));
  CHECK(json["path_recall"].is_null());
  CHECK(json["regions"].empty());
}

TEST_CASE("The text and the JSON object contain the same loop scores", "[loop_score]") {
  auto truth = laps(180);
  for (std::size_t k = 140; k < 150; ++k) truth[k]->translation().y() += 8.0;
  const auto score = score_loops(truth, {loop(105, 5), false_loop(106, 60)});
  const auto json = nlohmann::json::parse(loop_score_json(score));
  CHECK(json["accepted"] == 2);
  CHECK(json["accepted_false"] == 1);
  CHECK(json["revisits"] == 2);
  CHECK(json["revisits_found"] == 1);
  CHECK(json["median_delay_frames"] == 10);
  CHECK(json["regions"][0]["first_loop"] == 105);
  CHECK(json["regions"][1]["first_loop"].is_null());
  std::ostringstream text;
  print_loop_score(text, score);
  CHECK_THAT(text.str(), Catch::Contains("2 accepted, 1 of them false") &&
                             Catch::Contains("1 of 2 found (50 %)") && Catch::Contains("frames 150 to 179") &&
                             Catch::Contains("missed"));
}

TEST_CASE("loops.csv is read as it is written", "[loop_score]") {
  const TemporaryFolder folder;
  RunRecord record;
  record.loops = {loop(110, 10), loop(115, 14, false), loop(3, 400)};
  record.loops.back().in_loaded_map = true;
  std::ostringstream text;
  write_loops(text, record.loops);
  write_text(folder / "loops.csv", text.str());
  const auto loops = read_loops(folder / "loops.csv");
  REQUIRE(loops.size() == 3);
  CHECK(loops[2].in_loaded_map);
  CHECK(loops[2].old_frame == 400);
  CHECK(score_loops(laps(100), {loops[2]}).without_truth == 1);
  CHECK(loops[0].frame == 110);
  CHECK(loops[0].old_frame == 10);
  CHECK(loops[0].inliers == 50);
  CHECK(loops[0].chi2 == 3.5);
  CHECK(loops[0].accepted);
  CHECK(loops[0].T_old_new.is_approx(record.loops[0].T_old_new, 1e-8));
  CHECK_FALSE(loops[1].accepted);
}

TEST_CASE("A broken loops.csv is refused with file and line", "[loop_score]") {
  const TemporaryFolder folder;
  const fs::path file = folder / "loops.csv";
  const auto message = [&](const std::string& text) {
    write_text(file, text);
    return message_of([&] { (void)read_loops(file); });
  };
  const std::string header = "frame,old_frame,inliers,chi2,verdict,old_map,tx,ty,tz,qx,qy,qz,qw\n";
  const std::string pose = ",0,0,1,0,0,0,1";
  CHECK_THAT(message(""), Catch::Contains("not a loops.csv"));
  CHECK_THAT(message("frame,ms\n"), Catch::Contains("not a loops.csv"));
  for (const auto* row :
       {"110,10,50,3.5", "110,10,50,3.5,maybe,run", "110,10,50,nan,accepted,run", "-1,10,50,1,refused,run",
        "110,1.5,50,1,accepted,run", "110,10,50,3.5,accepted,7"}) {
    CAPTURE(row);
    CHECK_THAT(message(header + "9,2,5,1,refused,run" + pose + "\n" + row + pose + "\n"),
               Catch::Contains("loops.csv:3: expected two frames"));
  }
  for (const auto* wrong :
       {"", ",0,0,1,0,0,0", ",0,0,1,0,0,0,1,2", ",0,0,1,0,0,0,2", ",0,0,1,0,0,0,0", ",0,nan,1,0,0,0,1"}) {
    CAPTURE(wrong);
    CHECK_THAT(message(header + "9,2,5,1,refused,run" + wrong + "\n"),
               Catch::Contains("loops.csv:2: expected two frames"));
  }
  CHECK_THAT(message(header + "10,10,50,3.5,accepted,run" + pose + "\n"),
             Catch::Contains("loops.csv:2: the old frame 10 must be before"));
  CHECK_THAT(message_of([&] { (void)read_loops(folder / "none.csv"); }), Catch::Contains("cannot be read"));
  CHECK_THAT(message_of([&] { (void)score_loops(laps(100), {loop(100, 2)}); }),
             Catch::Contains("of the same run"));
}
