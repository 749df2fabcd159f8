// SPDX-License-Identifier: MIT
#include <algorithm>
#include <iostream>
#include <memory>
#include <optional>
#include <stdexcept>
#include <vector>

#include <fmt/format.h>
#include <fmt/ostream.h>

#include "stereo_slam/app/command.hpp"
#include "stereo_slam/app/info.hpp"
#include "stereo_slam/app/messages.hpp"
#include "stereo_slam/bags/bag_recording.hpp"
#include "stereo_slam/io/counted.hpp"
#include "stereo_slam/io/output_file.hpp"

namespace stereo_slam {
namespace {

struct InfoArguments {
  DatasetOptions dataset;
  std::optional<std::filesystem::path> ground_truth;
  PoseFrame pose_frame = PoseFrame::kCamera;
};

void print_topics(const std::filesystem::path& bag) {
  std::vector<Problem> known;  // not printed: the scan has reported an unreadable bag already
  attempt(known, Problem::Severity::kError, [&] {
    for (const auto& topic : list_topics(bag))
      fmt::print(std::cout, "topic         {}  {}  {}{}\n", as_message(topic.name), as_message(topic.type),
                 counted(topic.messages, "message"),
                 topic.rate_hz > 0.0 ? fmt::format(", {:.1f} per second", topic.rate_hz) : "");
  });
}

int info_command(const InfoArguments& arguments) {
  if (arguments.ground_truth) {
    require_replaceable(*arguments.ground_truth, {},
                        [](std::string_view beginning) { return beginning.starts_with(kGroundTruthHeader); });
    require_writable(*arguments.ground_truth);
  }
  const Inspection inspection = inspect(scan(arguments.dataset));
  print_inspection(std::cout, inspection);
  if (inspection.scan.sequence.format == "bag") print_topics(arguments.dataset.folder);
  const auto& problems = inspection.scan.problems;
  const auto error = std::ranges::find_if(problems, is_error);
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
  auto arguments = std::make_shared<InfoArguments>();
  auto& app = *parent.add_subcommand("info", "check a recording and print its contents");
  add_dataset_options(app, arguments->dataset);
  auto* ground_truth = app.add_option("--write-groundtruth", arguments->ground_truth,
                                      "write the ground truth to this file, in TUM format")
                           ->check(require_name)
                           ->type_name("FILE");
  add_pose_frame_option(app, arguments->pose_frame)->needs(ground_truth);
  app.footer(
      "Examples:\n"
      "  stereo_slam info --dataset euroc/MH_01_easy\n"
      "  stereo_slam info --dataset raw --calibration camchain.yaml\n"
      "  stereo_slam info --dataset drive.mcap                           (also lists its topics)");
  return [arguments] { return info_command(*arguments); };
}

}  // namespace stereo_slam
