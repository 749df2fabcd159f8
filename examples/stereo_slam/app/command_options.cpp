// SPDX-License-Identifier: MIT
#include <cstdlib>
#include <map>

#include <fmt/format.h>

#include "stereo_slam/app/command.hpp"

namespace stereo_slam {

void add_dataset_options(CLI::App& app, DatasetOptions& dataset) {
  app.add_option("--dataset", dataset.folder, "folder of the recording, or the calibration.yaml in it")
      ->required()
      ->type_name("DIR");
  app.add_option("--format", dataset.format, "layout of the folder; euroc includes TUM-VI")
      ->check(CLI::IsMember({"kitti", "euroc", "folders", "video", "auto"}))
      ->capture_default_str();
}

void add_pose_frame_option(CLI::App& app, PoseFrame& frame) {
  app.add_option("--pose-frame", frame,
                 "frame whose poses are written: the rectified left camera, or the body (EuRoC: the IMU); "
                 "default: camera")
      ->transform(CLI::CheckedTransformer(
          std::map<std::string, PoseFrame>{{"camera", PoseFrame::kCamera}, {"body", PoseFrame::kBody}}));
}

std::function<std::string(const std::string&)> number_between(double least, double most) {
  return [least, most](const std::string& text) {
    char* end = nullptr;
    const double value = std::strtod(text.c_str(), &end);
    const bool good = end != text.c_str() && *end == '\0' && value >= least && value <= most;
    return good ? std::string() : fmt::format("{} is not a number from {} to {}", text, least, most);
  };
}

}  // namespace stereo_slam
