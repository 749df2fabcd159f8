// SPDX-License-Identifier: MIT
#include <memory>
#include <optional>
#include <vector>

#include <fmt/format.h>

#include "stereo_slam/app/command.hpp"
#include "stereo_slam/io/text_file.hpp"
#include "stereo_slam/io/trajectory_io.hpp"
#include "stereo_slam/report/comparison.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

struct Arguments {
  std::vector<fs::path> runs;
  fs::path output;
  std::optional<fs::path> ground_truth;
  double max_difference_s = 0.01;
};

int compare_command(const Arguments& arguments) {
  std::vector<report::RunFolder> runs;
  for (const auto& folder : arguments.runs) runs.push_back(report::read_run_folder(folder));
  std::optional<report::ComparisonTruth> truth;
  if (arguments.ground_truth)
    truth = {.trajectory = read_trajectory(*arguments.ground_truth),
             .max_difference_s = arguments.max_difference_s};
  write_file(arguments.output, [&](std::ostream& out) { report::write_comparison(out, runs, truth); });
  fmt::print("{} run{} compared in {}\n", runs.size(), runs.size() == 1 ? "" : "s",
             arguments.output.string());
  return kDone;
}

}  // namespace

Command add_compare(CLI::App& parent) {
  auto arguments = std::make_shared<Arguments>();
  auto& app =
      *parent.add_subcommand("compare", "show several runs on one page: paths, errors, times, settings");
  app.add_option("runs", arguments->runs, "output folders of runs")->required()->type_name("DIR");
  app.add_option("--output", arguments->output, "page to write")->required()->type_name("FILE.html");
  app.add_option("--groundtruth", arguments->ground_truth,
                 "ground-truth trajectory that all runs are compared with")
      ->type_name("FILE");
  app.add_option("--max-time-difference", arguments->max_difference_s,
                 "largest time difference of matched poses, in seconds")
      ->check(number_between(0.0, 1e6))
      ->capture_default_str()
      ->type_name("S");
  app.footer(
      "Example:\n  stereo_slam compare out/06 out/06_paper --output compare.html --groundtruth poses/06.txt");
  return [arguments] { return compare_command(*arguments); };
}

}  // namespace stereo_slam
