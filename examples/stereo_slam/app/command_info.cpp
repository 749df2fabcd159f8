// SPDX-License-Identifier: MIT
#include <algorithm>
#include <iostream>
#include <memory>
#include <optional>
#include <stdexcept>

#include "stereo_slam/app/command.hpp"
#include "stereo_slam/app/info.hpp"
#include "stereo_slam/io/output_file.hpp"

namespace stereo_slam {
namespace {

struct Arguments {
  DatasetOptions dataset;
  std::optional<std::filesystem::path> ground_truth;
  PoseFrame pose_frame = PoseFrame::kCamera;
};

int info_command(const Arguments& arguments) {
  if (arguments.ground_truth) {
    require_replaceable(*arguments.ground_truth, {},
                        [](std::string_view beginning) { return beginning.starts_with(kGroundTruthHeader); });
    require_writable(*arguments.ground_truth);
  }
  const Inspection inspection = inspect_sequence(arguments.dataset.folder, arguments.dataset.format);
  print_inspection(std::cout, inspection);
  const auto& problems = inspection.scan.problems;
  const auto error = std::find_if(problems.begin(), problems.end(), is_error);
  if (error != problems.end()) throw std::runtime_error(error->text);
  if (arguments.ground_truth) {
    write_file(*arguments.ground_truth, [&](std::ostream& out) {
      write_ground_truth(out, inspection.scan.sequence, arguments.pose_frame);
    });
  }
  return kDone;
}

}  // namespace

Command add_info(CLI::App& parent) {
  auto arguments = std::make_shared<Arguments>();
  auto& app = *parent.add_subcommand("info", "check a recording and describe its contents");
  add_dataset_options(app, arguments->dataset);
  app.add_option("--write-groundtruth", arguments->ground_truth,
                 "write the ground truth to this file, in TUM format")
      ->check(require_name)
      ->type_name("FILE");
  add_pose_frame_option(app, arguments->pose_frame);
  app.footer("Example:\n  stereo_slam info --dataset euroc/MH_01_easy");
  return [arguments] { return info_command(*arguments); };
}

}  // namespace stereo_slam
