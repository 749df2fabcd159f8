// SPDX-License-Identifier: MIT
#include <memory>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "stereo_slam/app/command.hpp"
#include "stereo_slam/app/messages.hpp"
#include "stereo_slam/evaluation/file_warnings.hpp"
#include "stereo_slam/io/counted.hpp"
#include "stereo_slam/io/output_file.hpp"
#include "stereo_slam/io/trajectory_io.hpp"
#include "stereo_slam/report/comparison.hpp"
#include "stereo_slam/report/page.hpp"
#include "stereo_slam/results/output.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

struct CompareArguments {
  std::vector<fs::path> runs;
  fs::path output;
  std::optional<fs::path> ground_truth;
  double max_difference_s = 0.01;
};

/// Throws std::runtime_error if the page would replace one of its inputs.
void check_page(const CompareArguments& arguments) {
  std::vector<fs::path> inputs;
  if (arguments.ground_truth) inputs.push_back(*arguments.ground_truth);
  for (const auto& run : arguments.runs) {
    inputs.push_back(run / "run.yaml");
    for (const auto* name : result_files()) inputs.push_back(run / name);
  }
  require_replaceable(arguments.output, inputs, [](std::string_view beginning) {
    return report::is_page_of(report::kComparisonGenerator, beginning);
  });
  require_writable(arguments.output);
}

/// Prints what makes the errors of a run mean something else than they seem to, or why there are none.
void warn_of_files(const TrajectoryFile& truth, const report::RunFolder& run, double max_difference_s) {
  TrajectoryFile estimate{run.folder, run.trajectory};
  if (truth.trajectory.stamps_ns.empty()) estimate.trajectory.stamps_ns.clear();  // match by index
  try {
    const auto pairs = match_poses(truth.trajectory, estimate.trajectory, max_difference_s);
    for (const auto& warning : file_warnings(truth, estimate, pairs))
      print_message(fmt::format("warning: {}: {}", run.folder.string(), warning));
  } catch (const std::runtime_error& error) {
    print_message(fmt::format("warning: {}: the page has no errors of this run: {}", run.folder.string(),
                              error.what()));
  }
}

int compare_command(const CompareArguments& arguments) {
  check_page(arguments);
  std::vector<report::RunFolder> runs;
  for (const auto& folder : arguments.runs) runs.push_back(report::read_run_folder(folder));
  std::optional<report::ComparisonTruth> truth;
  if (arguments.ground_truth)
    truth = {.trajectory = read_trajectory(*arguments.ground_truth),
             .max_difference_s = arguments.max_difference_s};
  write_file(arguments.output, [&](std::ostream& out) { report::write_comparison(out, runs, truth); });
  if (truth) {
    for (const auto& run : runs)
      warn_of_files({*arguments.ground_truth, truth->trajectory}, run, arguments.max_difference_s);
  }
  fmt::print("{} compared in {}\n", counted(runs.size(), "run"), arguments.output.string());
  return kDone;
}

}  // namespace

Command add_compare(CLI::App& parent) {
  auto arguments = std::make_shared<CompareArguments>();
  auto& app =
      *parent.add_subcommand("compare", "show several runs on one page: paths, errors, times, settings");
  app.add_option("runs", arguments->runs, "output folders of runs")->required()->type_name("DIR");
  app.add_option("--output", arguments->output, "page to write")
      ->required()
      ->check(require_name)
      ->type_name("FILE.html");
  auto* ground_truth = app.add_option("--groundtruth", arguments->ground_truth,
                                      "ground-truth trajectory that all runs are compared with")
                           ->check(require_name)
                           ->type_name("FILE");
  app.add_option("--max-time-difference", arguments->max_difference_s,
                 "largest time difference of matched poses, in seconds")
      ->needs(ground_truth)
      ->check(number_between(0.0, 1e6))
      ->capture_default_str()
      ->type_name("S");
  app.footer(
      "Example:\n  stereo_slam compare out/06 out/06_paper --output compare.html --groundtruth poses/06.txt");
  return [arguments] { return compare_command(*arguments); };
}

}  // namespace stereo_slam
