// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/sequence.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include "stereo_slam/dataset/euroc.hpp"
#include "stereo_slam/dataset/image_file.hpp"
#include "stereo_slam/dataset/kitti.hpp"
#include "stereo_slam/dataset/own_camera.hpp"
#include "stereo_slam/dataset/rig_file.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

SequenceScan unusable(const fs::path& folder, std::string text) {
  SequenceScan scan;
  scan.sequence.folder = folder;
  scan.problems.push_back({Problem::Severity::kError, std::move(text)});
  return scan;
}

void check_size(const cv::Mat& image, const fs::path& file, const StereoCamera& camera) {
  if (image.cols == camera.width_px && image.rows == camera.height_px) return;
  throw std::runtime_error(wrong_size(file, image.cols, image.rows, camera).text);
}

/// The two raw images.
std::pair<cv::Mat, cv::Mat> load_images(const StereoSequence& sequence, std::size_t index) {
  const auto& files = sequence.frames.at(index);
  if (!sequence.video) return {load_gray_image(files.left), load_gray_image(files.right)};
  auto images = sequence.video->read(index);
  if (!images) {
    throw EndOfRecording(fmt::format("{}: the video ends at frame {}, its header promises {}",
                                     sequence.folder.string(), index, sequence.frames.size()));
  }
  return std::move(*images);
}

cv::Mat equalised(const cv::Mat& image, const ImageSettings& settings) {
  cv::Mat result;
  cv::createCLAHE(settings.clahe_clip_limit, {settings.clahe_tiles, settings.clahe_tiles})
      ->apply(image, result);
  return result;
}

}  // namespace

SequenceScan scan_sequence(const fs::path& folder, std::string_view format) {
  const std::string name = folder.string();
  const bool automatic = format == "auto";
  if (!fs::exists(folder)) return unusable(folder, fmt::format("{}: no such folder; check --dataset", name));
  if (is_calibration_file(folder) && (automatic || format == "folders" || format == "video"))
    return scan_own_camera(folder, format);
  if (!fs::is_directory(folder))
    return unusable(folder, fmt::format("{}: is not a folder; check --dataset", name));
  const bool has_calibration = fs::exists(folder / kCalibrationFile);
  if (format == "euroc" || (automatic && looks_like_euroc(folder))) return scan_euroc(folder);
  if (format == "kitti" || (automatic && !has_calibration && looks_like_kitti(folder)))
    return scan_kitti(folder);
  if (!automatic || has_calibration) return scan_own_camera(folder / kCalibrationFile, format);
  return unusable(
      folder,
      fmt::format(
          "{}: not a recording of a known layout; expected the KITTI layout ({}), the EuRoC layout ({}), or "
          "a camera of your own ({})",
          name, kKittiLayout, kEurocLayout, kOwnCameraLayout));
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
    problems.push_back({severity, error.what()});
  }
}

Problem wrong_size(const fs::path& file, int width_px, int height_px, const StereoCamera& camera) {
  return {Problem::Severity::kError,
          fmt::format("{}: is {}x{} pixels where the sequence has {}x{}; all images must have the same size",
                      file.string(), width_px, height_px, camera.width_px, camera.height_px)};
}

void set_rig(StereoSequence& sequence, const StereoRig& rig) {
  auto rectifier = std::make_shared<const Rectifier>(rig);
  sequence.camera = rectifier->camera();
  sequence.lenses = to_string(rig.left.distortion);
  if (rig.T_body_left) sequence.T_body_camera = *rig.T_body_left * rectifier->T_left_camera();
  sequence.rectifier = std::move(rectifier);
}

StereoFrame load_frame(const StereoSequence& sequence, std::size_t index, const ImageSettings& settings) {
  const auto& files = sequence.frames.at(index);
  auto [left, right] = load_images(sequence, index);
  check_size(left, files.left, sequence.camera);
  check_size(right, files.right, sequence.camera);
  if (sequence.rectifier) {
    left = sequence.rectifier->left(left);
    right = sequence.rectifier->right(right);
  }
  if (settings.clahe) {
    left = equalised(left, settings);
    right = equalised(right, settings);
  }
  return {.index = index, .stamp_ns = files.stamp_ns, .left = left, .right = right};
}

}  // namespace stereo_slam
