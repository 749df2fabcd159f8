// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/sequence.hpp"

#include <algorithm>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "stereo_slam/calibration/rig_file.hpp"
#include "stereo_slam/dataset/euroc.hpp"
#include "stereo_slam/dataset/kitti.hpp"
#include "stereo_slam/dataset/own_camera.hpp"
#include "stereo_slam/dataset/recording_checks.hpp"
#include "stereo_slam/images/live_camera.hpp"
#include "stereo_slam/images/video.hpp"
#include "stereo_slam/io/file_error.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

SequenceScan unusable(const fs::path& folder, std::string text) {
  SequenceScan scan;
  scan.sequence.folder = folder;
  scan.problems.push_back({Problem::Severity::kError, std::move(text)});
  return scan;
}

/// Whether it is a file of a ROS 2 bag, or its folder.
[[nodiscard]] bool is_ros2_bag(const fs::path& dataset) {
  const auto has_extension = [](const fs::path& file) {
    return file.extension() == ".db3" || file.extension() == ".mcap";
  };
  if (!fs::is_directory(dataset)) return has_extension(dataset);
  std::error_code error;
  const bool has_metadata = fs::exists(dataset / "metadata.yaml", error);
  if (error == std::errc::permission_denied) throw fs::filesystem_error("", dataset, error);
  if (!has_metadata) return false;
  const fs::directory_iterator files(dataset);
  return std::any_of(begin(files), end(files), [&](const auto& file) { return has_extension(file.path()); });
}

SequenceScan scan_layout(const fs::path& folder, std::string_view format, const fs::path& calibration,
                         const PairingOptions& pairing) {
  const std::string name = folder.string();
  const bool automatic = format == "auto";
  if (is_ros2_bag(folder)) {
    return unusable(folder, fmt::format("{}: bags of ROS 2 are not read; convert it with rosbags: "
                                        "rosbags-convert --src {} --dst recording.bag",
                                        name, name));
  }
  if (!calibration.empty())
    return scan_own_camera({.calibration = calibration, .dataset = folder}, format, pairing);
  if (!is_live(folder) && !fs::exists(folder)) {
    return unusable(folder, fmt::format("{}: no such {}; check --dataset", name,
                                        folder.has_extension() ? "file or folder" : "folder"));
  }
  if (is_live(folder) || has_video_name(folder)) {
    return unusable(folder,
                    fmt::format("{}: the camera that took these images is not known; name its calibration: "
                                "--calibration FILE",
                                name));
  }
  if (is_calibration_file(folder) && (automatic || format == "folders" || format == "video"))
    return scan_own_camera({.calibration = folder, .dataset = {}}, format, pairing);
  if (!fs::is_directory(folder))
    return unusable(folder, fmt::format("{}: is not a folder; check --dataset", name));
  const auto calibration_in_folder = find_calibration(folder);
  const bool has_calibration = !calibration_in_folder.empty();
  if (format == "euroc" || (automatic && looks_like_euroc(folder))) return scan_euroc(folder, pairing);
  if (format == "kitti" || (automatic && !has_calibration && looks_like_kitti(folder)))
    return scan_kitti(folder, pairing);
  if (!automatic || has_calibration) {
    return scan_own_camera(
        {.calibration = has_calibration ? calibration_in_folder : folder / kCalibrationFile, .dataset = {}},
        format, pairing);
  }
  return unusable(
      folder,
      fmt::format(
          "{}: not a recording of a known layout; expected the KITTI layout ({}), the EuRoC layout ({}), or "
          "a camera of your own ({})",
          name, kKittiLayout, kEurocLayout, kOwnCameraLayout));
}

}  // namespace

SequenceScan scan_sequence(const fs::path& folder, std::string_view format, const fs::path& calibration,
                           const PairingOptions& pairing) {
  SequenceScan scan;
  try {
    scan = scan_layout(folder, format, calibration, pairing);
  } catch (const fs::filesystem_error& error) {
    return unusable(folder, file_error_text(error));
  }
  check_rig(scan);
  check_camera(scan);
  check_frame_rate(scan);
  find_scale(scan);
  return scan;
}

std::string full_name(const StereoSequence& sequence) {
  return sequence.live ? sequence.folder.string() : fs::absolute(sequence.folder).string();
}

StereoSequence open_sequence(const fs::path& folder, std::string_view format) {
  SequenceScan scan = scan_sequence(folder, format);
  const auto error = std::find_if(scan.problems.begin(), scan.problems.end(), is_error);
  if (error != scan.problems.end()) throw std::runtime_error(error->text);
  return std::move(scan.sequence);
}

void attempt(std::vector<Problem>& problems, Problem::Severity severity, const std::function<void()>& step) {
  try {
    step();
  } catch (const std::exception& error) {
    problems.push_back({severity, file_error_text(error)});
  }
}

cv::Size image_size(const StereoSequence& sequence, bool is_left) {
  if (sequence.rectifier) return is_left ? sequence.rectifier->left_size() : sequence.rectifier->right_size();
  return {sequence.camera.width_px, sequence.camera.height_px};
}

cv::Size recorded_size(const StereoSequence& sequence, bool is_left) {
  if (sequence.unscaled.empty()) return image_size(sequence, is_left);
  return is_left ? sequence.unscaled : sequence.unscaled_right;
}

Problem wrong_size(std::string_view image, const cv::Size& size, const cv::Size& all) {
  return {Problem::Severity::kError,
          fmt::format("{}: is {}x{} pixels where the sequence has {}x{}; all images must have the same size",
                      image, size.width, size.height, all.width, all.height)};
}

void set_rig(StereoSequence& sequence, const StereoRig& rig) {
  sequence.rig = rig;
  auto rectifier = std::make_shared<const Rectifier>(rig);
  sequence.camera = rectifier->camera();
  sequence.lenses = to_string(rig.left.distortion);
  if (rig.T_body_left) sequence.T_body_camera = *rig.T_body_left * rectifier->T_left_camera();
  sequence.rectifier = std::move(rectifier);
}

}  // namespace stereo_slam
