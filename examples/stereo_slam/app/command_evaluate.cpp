// SPDX-License-Identifier: MIT
#include <iostream>
#include <map>
#include <memory>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "stereo_slam/app/command.hpp"
#include "stereo_slam/app/messages.hpp"
#include "stereo_slam/evaluation/evaluate.hpp"
#include "stereo_slam/evaluation/file_warnings.hpp"
#include "stereo_slam/evaluation/inertial_score.hpp"
#include "stereo_slam/evaluation/loop_score.hpp"
#include "stereo_slam/evaluation/nees.hpp"
#include "stereo_slam/io/counted.hpp"
#include "stereo_slam/io/output_file.hpp"
#include "stereo_slam/io/trajectory_io.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

struct EvaluateArguments {
  fs::path ground_truth;
  fs::path estimate;
  std::optional<TrajectoryFormat> format;
  double max_difference_s = 0.01;
  std::optional<fs::path> json;
  std::optional<fs::path> covariances;
  double truth_sigma_m = 0.0;
  double truth_sigma_deg = 0.0;
  std::optional<fs::path> loops;
  std::optional<fs::path> inertial;
  std::optional<double> imu_delay_ms;
  RevisitRule revisits;
};

void add_trajectory_options(CLI::App& app, EvaluateArguments& arguments) {
  app.add_option("--groundtruth", arguments.ground_truth, "ground-truth trajectory")
      ->required()
      ->check(require_name)
      ->type_name("FILE");
  app.add_option("--estimate", arguments.estimate, "estimated trajectory")
      ->required()
      ->check(require_name)
      ->type_name("FILE");
  let_be_one_of<TrajectoryFormat>(
      app.add_option("--format", arguments.format,
                     "format of both files; default: recognised by their columns"),
      {{"kitti", TrajectoryFormat::kKitti},
       {"tum", TrajectoryFormat::kTum},
       {"euroc", TrajectoryFormat::kEuroc}});
  app.add_option("--max-time-difference", arguments.max_difference_s,
                 "largest time difference of matched poses, in seconds")
      ->check(number_between(0.0, 1e6))
      ->capture_default_str()
      ->type_name("S");
  app.add_option("--json", arguments.json, "also write the scores to this file")
      ->check(require_name)
      ->type_name("FILE");
}

void add_covariance_options(CLI::App& app, EvaluateArguments& arguments) {
  auto* covariances =
      app.add_option("--covariances", arguments.covariances,
                     "covariances.csv of the run: compare its covariances with the errors (NEES)")
          ->check(require_name)
          ->type_name("FILE");
  app.add_option("--truth-sigma-m", arguments.truth_sigma_m,
                 "standard deviation of relative positions of the ground truth, per axis, in m")
      ->needs(covariances)
      ->check(number_between(0.0, 1e6))
      ->capture_default_str();
  app.add_option("--truth-sigma-deg", arguments.truth_sigma_deg,
                 "standard deviation of relative rotations of the ground truth, per axis, in degrees")
      ->needs(covariances)
      ->check(number_between(0.0, 1e6))
      ->capture_default_str();
}

void add_loop_options(CLI::App& app, EvaluateArguments& arguments) {
  auto* loops = app.add_option("--loops", arguments.loops,
                               "loops.csv of the run: report loop-closure precision and recall")
                    ->check(require_name)
                    ->type_name("FILE");
  app.add_option("--min-gap-frames", arguments.revisits.min_gap_frames,
                 "smallest number of frames between two visits of a place; the SLAM has 60")
      ->needs(loops)
      ->check(whole_number_between(1, 1'000'000))
      ->capture_default_str()
      ->type_name("N");
}

void add_inertial_options(CLI::App& app, EvaluateArguments& arguments) {
  auto* inertial =
      app.add_option(
             "--inertial", arguments.inertial,
             "inertial.csv of a run with --imu: report the errors of velocity, tilt and biases; the ground "
             "truth is EuRoC's state_groundtruth_estimate0/data.csv, or that of simulate --format euroc")
          ->check(require_name)
          ->type_name("FILE");
  app.add_option("--imu-delay", arguments.imu_delay_ms,
                 "by how much the stamps of the IMU really were later than those of the images, besides "
                 "timeshift_cam_imu: report the errors of the delay, too")
      ->needs(inertial)
      ->check(number_between(-1e6, 1e6))
      ->type_name("MS");
}

/// Throws std::runtime_error if the file of --json would replace one of the inputs.
void check_json(const EvaluateArguments& arguments) {
  if (!arguments.json) return;
  std::vector<fs::path> inputs = {arguments.ground_truth, arguments.estimate};
  for (const auto& more : {arguments.covariances, arguments.loops, arguments.inertial}) {
    if (more) inputs.push_back(*more);
  }
  require_replaceable(*arguments.json, inputs, [](std::string_view beginning) {
    return beginning.starts_with("{\n  \"frames_matched\": ");
  });
  require_writable(*arguments.json);
}

/// "FILE (1 UNIT)" or "FILE (COUNT UNITs)", for messages.
[[nodiscard]] std::string named(const fs::path& file, std::size_t count, const char* unit) {
  return fmt::format("{} ({})", file.string(), counted(count, unit));
}

/// Calls `compare`, which compares the contents of two files, and adds the names of both to its errors.
template <class Compare>
auto compare_files(const std::string& first, const std::string& second, const Compare& compare) {
  try {
    return compare();
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(fmt::format("{} and {}: {}", first, second, error.what()));
  }
}

/// Prints the score of the covariances; returns it as a member of the JSON file.
[[nodiscard]] std::string evaluate_covariances(const EvaluateArguments& arguments, const Trajectory& truth,
                                               const Trajectory& estimate, const FramePairs& pairs) {
  constexpr double kRadians = std::numbers::pi / 180.0;
  const auto rows = read_covariances(*arguments.covariances);
  const NeesReport nees = compare_files(
      named(*arguments.covariances, rows.size(), "row"),
      named(arguments.estimate, estimate.poses.size(), "pose"), [&] {
        return score_covariances(truth, estimate, pairs, rows,
                                 {arguments.truth_sigma_m, kRadians * arguments.truth_sigma_deg});
      });
  print_nees(std::cout, nees);
  return "\"nees\": " + nees_json(nees);
}

/// Prints the score of the loops; returns it as a member of the JSON file.
[[nodiscard]] std::string evaluate_loops(const EvaluateArguments& arguments, const Trajectory& truth,
                                         const Trajectory& estimate, const FramePairs& pairs) {
  const auto events = read_loops(*arguments.loops);
  const LoopScore loops = compare_files(
      named(*arguments.loops, events.size(), "loop"),
      named(arguments.estimate, estimate.poses.size(), "pose"), [&] {
        return score_loops(poses_at_frames(truth, pairs, estimate.poses.size()), events, arguments.revisits);
      });
  print_loop_score(std::cout, loops);
  return "\"loops\": " + loop_score_json(loops);
}

/// Prints the score of velocity, tilt, biases and delay; returns it as a member of the JSON file.
[[nodiscard]] std::string evaluate_inertial(const EvaluateArguments& arguments) {
  const auto rows = read_inertial(*arguments.inertial);
  const auto truth = read_true_inertial_states(arguments.ground_truth);
  std::optional<double> delay_s;
  if (arguments.imu_delay_ms) delay_s = 1e-3 * *arguments.imu_delay_ms;
  const InertialScore score =
      compare_files(named(*arguments.inertial, rows.size(), "running frame"),
                    named(arguments.ground_truth, truth.size(), "state"),
                    [&] { return score_inertial(rows, truth, arguments.max_difference_s, delay_s); });
  print_inertial_score(std::cout, score);
  return "\"inertial\": " + inertial_score_json(score);
}

constexpr auto kReplaceInvalid = nlohmann::json::error_handler_t::replace;  // names that are not UTF-8

int evaluate_command(const EvaluateArguments& arguments) {
  check_json(arguments);
  const TrajectoryFile true_file{arguments.ground_truth,
                                 read_trajectory(arguments.ground_truth, arguments.format)};
  const TrajectoryFile file{arguments.estimate, read_trajectory(arguments.estimate, arguments.format)};
  const Trajectory& truth = true_file.trajectory;
  const Trajectory& estimate = file.trajectory;
  const auto [evaluation, pairs] =
      compare_files(named(arguments.ground_truth, truth.poses.size(), "pose"),
                    named(arguments.estimate, estimate.poses.size(), "pose"), [&] {
                      return std::pair(evaluate(truth, estimate, arguments.max_difference_s),
                                       match_poses(truth, estimate, arguments.max_difference_s));
                    });
  const auto warnings = file_warnings(true_file, file, pairs);
  for (const auto& warning : warnings) print_message("warning: " + warning);
  print_evaluation(std::cout, evaluation);
  std::vector<std::string> members;
  if (arguments.covariances) members.push_back(evaluate_covariances(arguments, truth, estimate, pairs));
  if (arguments.loops) members.push_back(evaluate_loops(arguments, truth, estimate, pairs));
  if (arguments.inertial) members.push_back(evaluate_inertial(arguments));
  members.push_back("\"warnings\": " + nlohmann::json(warnings).dump(-1, ' ', false, kReplaceInvalid));
  if (arguments.json) {
    write_file(*arguments.json, [&, &scores = evaluation](std::ostream& out) {
      write_evaluation_json(out, scores, fmt::format("{}", fmt::join(members, ",\n  ")));
    });
  }
  return kDone;
}

}  // namespace

Command add_evaluate(CLI::App& parent) {
  auto arguments = std::make_shared<EvaluateArguments>();
  auto& app = *parent.add_subcommand("evaluate", "compare an estimated trajectory with ground truth");
  add_trajectory_options(app, *arguments);
  add_covariance_options(app, *arguments);
  add_loop_options(app, *arguments);
  add_inertial_options(app, *arguments);
  app.footer(
      "Examples:\n"
      "  stereo_slam evaluate --groundtruth poses/06.txt --estimate out/06/trajectory_kitti.txt\n"
      "  stereo_slam evaluate --groundtruth truth.txt --estimate out/trajectory_tum.txt --covariances "
      "out/covariances.csv");
  return [arguments] { return evaluate_command(*arguments); };
}

}  // namespace stereo_slam
