// SPDX-License-Identifier: MIT
#include <charconv>
#include <map>

#include <fmt/format.h>

#include "stereo_slam/app/command.hpp"

namespace stereo_slam {

void add_dataset_options(CLI::App& app, DatasetOptions& dataset) {
  app.add_option("--dataset", dataset.folder, "folder of the recording, or the calibration.yaml in it")
      ->required()
      ->check(require_name)
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
    double value = 0.0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    const bool good =
        error == std::errc{} && end == text.data() + text.size() && value >= least && value <= most;
    return good ? std::string() : fmt::format("{} is not a number from {} to {}", text, least, most);
  };
}

std::function<std::string(const std::string&)> whole_number_between(std::uint64_t least, std::uint64_t most) {
  return [least, most](const std::string& text) {
    std::uint64_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    const bool octal = text.size() > 1 && text.starts_with('0');  // CLI11 would read it so
    const bool good =
        error == std::errc{} && end == text.data() + text.size() && !octal && value >= least && value <= most;
    return good ? std::string() : fmt::format("{} is not a whole number from {} to {}", text, least, most);
  };
}

std::string require_name(const std::string& path) {
  return path.empty() ? "the name is empty" : std::string();
}

}  // namespace stereo_slam
