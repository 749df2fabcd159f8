// SPDX-License-Identifier: MIT
#include <algorithm>
#include <charconv>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "stereo_slam/app/command.hpp"
#include "stereo_slam/bags/bag_recording.hpp"
#include "stereo_slam/dataset/shifted_pairs.hpp"
#include "stereo_slam/io/file_error.hpp"

namespace stereo_slam {

void add_dataset_options(CLI::App& app, DatasetOptions& dataset) {
  app.add_option(
         "--dataset", dataset.folder,
         "recording: a folder, the calibration.yaml in it, or a bag of ROS 2 or 1 (.mcap, .db3, .bag; "
         "parts of one as BAG,BAG,...); with --calibration also a video or a live camera (/dev/video0, a "
         "URL) with "
         "both images side by side, or two as LEFT,RIGHT")
      ->required()
      ->check(require_name)
      ->type_name("DIR");
  app.add_option("--calibration", dataset.calibration,
                 "calibration of the camera, if it is not in the folder: calibration.yaml, or a file of "
                 "Kalibr, OpenCV, ROS (left.yaml with right.yaml beside it), a ZED, ORB-SLAM, stella_vslam, "
                 "VINS, OpenVINS or Basalt")
      ->check(require_name)
      ->type_name("FILE");
  auto* left_topic =
      app.add_option("--left-topic", dataset.left_topic,
                     "topic of the left images in a bag; needed if the bag has no pair of topics, or more "
                     "than one, called left and right, cam0 and cam1 or the like; the same as --right-topic "
                     "for images that show both cameras side by side")
          ->type_name("TOPIC");
  app.add_option("--right-topic", dataset.right_topic, "topic of the right images in a bag")
      ->type_name("TOPIC")
      ->needs(left_topic);
  left_topic->needs("--right-topic");
  app.add_flag(
      "--record-times", dataset.record_times,
      "in a bag, use the times at which images and samples of an IMU were recorded, not the stamps in "
      "their headers");
  constexpr double kMostApart_ms = 1e6;
  app.add_option("--max-pair-distance-ms", dataset.max_pair_distance_ms,
                 "how far apart the stamps of a left and a right image may be; default: less than half the "
                 "time between two frames")
      ->check(number_between(0.0, kMostApart_ms))
      ->type_name("MS");
  app.add_flag("--right-half-first", dataset.right_half_first,
               "in images that show both cameras side by side, the first half is that of the right camera");
  constexpr int kMostOffset = 1000;
  app.add_option(
         "--right-image-offset", dataset.right_image_offset,
         "pair every left image with the right image N frames later (negative: earlier); with 0 a run "
         "goes on although pairs look shifted")
      ->check(integer_between(-kMostOffset, kMostOffset))
      ->type_name("N");
  let_be_one_of(app.add_option("--format", dataset.format,
                               "layout of the folder; euroc includes TUM-VI; default: auto"),
                {"kitti", "euroc", "folders", "video", "auto"});
  app.add_option("--scale", dataset.scale,
                 "scale the images by this factor, and the calibration with them; default: 1")
      ->check(number_between(0.01, 1.0))
      ->type_name("FACTOR");
}

namespace {

[[nodiscard]] SequenceScan scan_unscaled(const DatasetOptions& dataset) {
  PairingOptions pairing{.right_half_first = dataset.right_half_first};
  if (dataset.max_pair_distance_ms) pairing.most_apart_ns = std::llround(1e6 * *dataset.max_pair_distance_ms);
  if (is_bag_recording(dataset.folder)) {
    return scan_bag(dataset.folder, {.left_topic = dataset.left_topic,
                                     .right_topic = dataset.right_topic,
                                     .calibration = dataset.calibration,
                                     .imu_topic = dataset.imu_topic,
                                     .pairing = pairing,
                                     .record_times = dataset.record_times});
  }
  if (!dataset.left_topic.empty() || !dataset.right_topic.empty() || dataset.record_times) {
    fail(dataset.folder,
         "is no bag; --left-topic, --right-topic and --record-times are for bags (.mcap, .db3, .bag)");
  }
  return scan_sequence(dataset.folder, dataset.format, dataset.calibration, pairing);
}

}  // namespace

SequenceScan scan(const DatasetOptions& dataset) {
  SequenceScan scan = scan_unscaled(dataset);
  if (dataset.right_image_offset) offset_right_images(scan, *dataset.right_image_offset);
  scale_images(scan, dataset.scale);
  check_memory(scan);
  return scan;
}

CLI::Option* add_pose_frame_option(CLI::App& app, PoseFrame& frame) {
  auto* option = app.add_option("--pose-frame", frame,
                                "frame whose poses are written: camera (the rectified left one) or body "
                                "(EuRoC: the IMU); default: camera");
  let_be_one_of<PoseFrame>(option, {{"camera", PoseFrame::kCamera}, {"body", PoseFrame::kBody}});
  return option;
}

void let_be_one_of(CLI::Option* option, const std::vector<std::string>& names) {
  option->check(one_of(names))->type_name(fmt::format("{}", fmt::join(names, "|")));
}

std::function<std::string(const std::string&)> one_of(const std::vector<std::string>& names) {
  return [names](const std::string& text) {
    const bool good = std::ranges::find(names, text) != names.end();
    return good ? std::string() : fmt::format("{} is not one of {}", text, fmt::join(names, ", "));
  };
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

std::function<std::string(const std::string&)> integer_between(int least, int most) {
  return [least, most](const std::string& text) {
    const bool negative = text.starts_with('-');
    const auto digits = negative ? text.substr(1) : text;
    const std::uint64_t bound = static_cast<std::uint64_t>(std::abs(negative ? least : most));
    return whole_number_between(0, bound)(digits).empty()
               ? std::string()
               : fmt::format("{} is not a whole number from {} to {}", text, least, most);
  };
}

std::function<std::string(const std::string&)> whole_number_between(std::uint64_t least, std::uint64_t most) {
  return [least, most](const std::string& text) {
    std::uint64_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    const bool octal = text.size() > 1 && text.starts_with('0');  // CLI11 would read the text as octal
    const bool good =
        error == std::errc{} && end == text.data() + text.size() && !octal && value >= least && value <= most;
    return good ? std::string() : fmt::format("{} is not a whole number from {} to {}", text, least, most);
  };
}

std::string require_name(const std::string& path) {
  if (path.empty()) return "the name is empty";
  return path.starts_with("--") ? fmt::format("a name is missing before {}", path) : std::string();
}

}  // namespace stereo_slam
