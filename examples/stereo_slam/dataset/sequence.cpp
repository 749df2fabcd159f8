// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/sequence.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "stereo_slam/calibration/rig_file.hpp"
#include "stereo_slam/dataset/euroc.hpp"
#include "stereo_slam/dataset/kitti.hpp"
#include "stereo_slam/dataset/own_camera.hpp"
#include "stereo_slam/dataset/recording_checks.hpp"
#include "stereo_slam/images/live_camera.hpp"
#include "stereo_slam/images/video.hpp"
#include "stereo_slam/io/counted.hpp"
#include "stereo_slam/io/file_error.hpp"
#include "stereo_slam/io/folder_names.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

/// The scan of a folder whose only problem is why it cannot be read.
template <class... Values>
SequenceScan unusable(const fs::path& folder, fmt::format_string<Values...> why, Values&&... values) {
  SequenceScan scan;
  scan.sequence.folder = folder;
  scan.problems.push_back(Problem::error(folder, why, std::forward<Values>(values)...));
  return scan;
}

/// Whether a folder looks like a recording, so that it can be named in its place.
bool looks_like_recording(const fs::path& folder) {
  if (looks_like_euroc(folder) || looks_like_kitti(folder)) return true;
  std::vector<Problem> ignored;
  fs::path calibration;
  attempt(ignored, Problem::Severity::kWarning, [&] { calibration = find_calibration(folder); });
  return !calibration.empty();
}

/// The folders one or two levels above or below that look like recordings, for a message; empty if none does.
std::string other_levels(const fs::path& folder) {
  std::error_code error;
  const fs::path given = fs::absolute(folder, error).lexically_normal();
  const fs::path parent = given.has_filename() ? given.parent_path() : given.parent_path().parent_path();
  for (const auto& above : {parent, parent.parent_path()}) {
    if (looks_like_recording(above)) return fmt::format("; the recording may be {}", above.string());
  }
  std::vector<fs::path> level = {folder};
  for (int depth = 0; depth < 2; ++depth) {
    std::vector<fs::path> below;
    for (const auto& parent_folder : level) {
      for (auto& child : folders_in(parent_folder)) below.push_back(std::move(child));
    }
    level = std::move(below);
    const auto count = std::ranges::count_if(level, looks_like_recording);
    if (count == 0) continue;
    const auto first = std::ranges::find_if(level, looks_like_recording);
    return fmt::format(
        "; the recording may be {}{}", first->string(),
        count > 1 ? " or " + counted(static_cast<std::size_t>(count - 1), "other folder") : "");
  }
  return "";
}

SequenceScan scan_layout(const fs::path& folder, std::string_view format, const fs::path& calibration,
                         const PairingOptions& pairing) {
  const bool automatic = format == "auto";
  if (!calibration.empty())
    return scan_own_camera({.calibration = calibration, .dataset = folder}, format, pairing);
  if (!is_live(folder) && !fs::exists(folder)) {
    return unusable(folder, "no such {}; check --dataset",
                    folder.has_extension() ? "file or folder" : "folder");
  }
  if (is_live(folder) || has_video_name(folder)) {
    return unusable(
        folder, "the camera that took these images is not known; name its calibration: --calibration FILE");
  }
  if (is_calibration_file(folder) && (automatic || format == "folders" || format == "video"))
    return scan_own_camera({.calibration = folder, .dataset = {}}, format, pairing);
  if (!fs::is_directory(folder))
    return unusable(folder, "is not a folder, video or bag; unpack archives, and check --dataset");
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
  const std::string names = names_in(folder);
  if (fs::exists(folder / "left") && fs::exists(folder / "right")) {
    return unusable(folder,
                    "has left and right, but no calibration under a name that is looked for, such as {}; it "
                    "has {}; name the calibration: --calibration FILE",
                    kCalibrationFile, names);
  }
  return unusable(folder,
                  "not a recording of a known layout{}{}; expected the KITTI layout "
                  "({}), the EuRoC layout ({}), or a camera of your own ({})",
                  names.empty() ? "" : " (it has " + names + ")", other_levels(folder), kKittiLayout,
                  kEurocLayout, kOwnCameraLayout);
}

/// The IMU of a recording: from `file`, unless that is empty.
ImuRecording imu_of(const StereoSequence& sequence, const fs::path& file) {
  if (sequence.live) fail(sequence.folder, "is a live camera, whose IMU cannot be read; leave out --imu");
  const CameraAndImu camera{.T_body_camera = sequence.T_body_camera,
                            .later_ns = sequence.rig ? sequence.rig->imu_later_ns : std::nullopt};
  if (file.empty() && sequence.recorded_imu) return sequence.recorded_imu(camera);
  const auto samples = file.empty() ? find_imu(sequence.folder) : std::optional(file);
  if (!samples)
    fail(sequence.folder, "has no samples of an IMU (imu0/data.csv or imu.csv); name them with --imu-file");
  return read_imu(*samples, camera);
}

}  // namespace

SequenceScan scan_sequence(const fs::path& folder, std::string_view format, const fs::path& calibration,
                           const PairingOptions& pairing) {
  SequenceScan scan;
  try {
    scan = scan_layout(folder, format, calibration, pairing);
  } catch (const fs::filesystem_error& error) {
    scan.sequence.folder = folder;
    scan.problems.push_back({Problem::Severity::kError, file_error_text(error)});
    return scan;
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
  const auto error = std::ranges::find_if(scan.problems, is_error);
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

void add_imu(SequenceScan& scan, const fs::path& file) {
  StereoSequence& sequence = scan.sequence;
  attempt(scan.problems, Problem::Severity::kError, [&] {
    auto imu = std::make_shared<ImuRecording>(imu_of(sequence, file));
    if (!sequence.frames.empty()) {
      const auto missing =
          check_overlap(*imu, sequence.frames.front().stamp_ns, sequence.frames.back().stamp_ns);
      if (missing) scan.warn(imu->file, "{}", *missing);
    }
    for (const auto& text : imu->faults.texts()) scan.warn(imu->file, "{}", text);
    sequence.imu = std::move(imu);
  });
}

void set_rig(StereoSequence& sequence, const StereoRig& rig) {
  sequence.rig = rig;
  auto rectifier = std::make_shared<const Rectifier>(rig);
  sequence.camera = rectifier->camera();
  sequence.lenses = to_string(rig.left.distortion);
  if (rig.T_body_left) sequence.T_body_camera = *rig.T_body_left * rectifier->T_left_camera();
  sequence.rectifier = std::move(rectifier);
}

void set_rig(StereoSequence& sequence, const StereoRig& rig, const fs::path& file) {
  try {
    set_rig(sequence, rig);
  } catch (const std::runtime_error& error) {
    fail(file, error.what());
  }
}

void set_ground_truth(StereoSequence& sequence, const std::vector<std::int64_t>& stamps_ns,
                      const std::vector<Eigen::Isometry3d>& T_world_body, const fs::path& file) {
  constexpr std::int64_t kMargin_ns = 50'000'000;
  for (std::size_t i = 0; i < T_world_body.size(); ++i) {
    if (stamps_ns[i] < sequence.frames.front().stamp_ns - kMargin_ns) continue;
    if (stamps_ns[i] > sequence.frames.back().stamp_ns + kMargin_ns) break;
    sequence.ground_truth.push_back(T_world_body[i] * *sequence.T_body_camera);
    sequence.ground_truth_ns.push_back(stamps_ns[i]);
  }
  if (sequence.ground_truth.empty()) fail(file, "contains no pose at the time of the images");
}

}  // namespace stereo_slam
