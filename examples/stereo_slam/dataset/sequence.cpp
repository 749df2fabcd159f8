// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/sequence.hpp"

#include <algorithm>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "stereo_slam/dataset/euroc.hpp"
#include "stereo_slam/dataset/grey_image.hpp"
#include "stereo_slam/dataset/image_file.hpp"
#include "stereo_slam/dataset/kitti.hpp"
#include "stereo_slam/dataset/live_camera.hpp"
#include "stereo_slam/dataset/own_camera.hpp"
#include "stereo_slam/dataset/recording_checks.hpp"
#include "stereo_slam/dataset/rig_file.hpp"
#include "stereo_slam/dataset/video.hpp"
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

/// The file of the left or right image of a frame; in a bag, video or live camera, its name and the frame.
std::string image_name(const StereoSequence& sequence, std::size_t index, bool is_left) {
  if (sequence.source) {
    return fmt::format("{}: frame {} of {}", sequence.folder.string(), index,
                       is_left ? sequence.left_name : sequence.right_name);
  }
  const StereoFiles& files = sequence.frames.at(index);
  return (is_left ? files.left : files.right).string();
}

void check_size(const cv::Mat& image, const StereoSequence& sequence, std::size_t index, bool is_left) {
  const cv::Size all = image_size(sequence, is_left);
  if (image.size() == all) return;
  throw std::runtime_error(wrong_size(image_name(sequence, index, is_left), image.size(), all).text);
}

RawPair read_source(const StereoSequence& sequence, std::size_t index) {
  auto images = sequence.source->read(index);
  if (images) return std::move(*images);
  throw EndOfRecording(sequence.live ? fmt::format("{}: delivers no more images", sequence.folder.string())
                                     : fmt::format("{}: the video ends at frame {}, its header promises {}",
                                                   sequence.folder.string(), index, sequence.frames.size()));
}

RawPair read_files(const StereoSequence& sequence, std::size_t left, std::size_t right) {
  const auto& files = sequence.frames;
  const int bits = sequence.bits;
  if (!sequence.side_by_side)
    return {load_gray_image(files.at(left).left, bits), load_gray_image(files.at(right).right, bits)};
  const auto read_both = [&](std::size_t index) {
    try {
      return split(load_gray_image(files.at(index).left, bits));
    } catch (const std::invalid_argument& error) {
      throw std::runtime_error(fmt::format("{}: {}", files.at(index).left.string(), error.what()));
    }
  };
  RawPair pair = read_both(left);
  if (right != left) pair.right = read_both(right).right;
  return pair;
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

/// used_bits() of a pair with 16 bits a pixel; nothing if either image has 8.
[[nodiscard]] std::optional<int> bits_of_pair(const StereoSequence& sequence, std::size_t index) {
  if (sequence.source) return sequence.source->bits_of_16(index);
  const auto left = bits_of_16(sequence.frames[index].left);
  if (!left) return std::nullopt;
  const auto right = bits_of_16(sequence.frames[index].right);
  return right ? std::optional(std::max(*left, *right)) : std::nullopt;
}

}  // namespace

void find_bits(SequenceScan& scan) {
  constexpr std::size_t kMostPairs = 16;
  auto& sequence = scan.sequence;
  const std::size_t frames = sequence.frames.size();
  const std::size_t pairs = std::min(kMostPairs, frames);
  int bits = 0;
  try {
    for (std::size_t i = 0; i < pairs && bits < 16; ++i) {
      const auto used = bits_of_pair(sequence, i * (frames - 1) / std::max<std::size_t>(pairs - 1, 1));
      if (!used) return;
      bits = std::max(bits, *used);
    }
  } catch (const std::runtime_error&) {
    return;  // an image that cannot be read is reported where it is loaded
  }
  if (bits == 0 || bits == 16) return;
  sequence.bits = bits;
  if (sequence.source) sequence.source->use_bits(bits);
  scan.problems.push_back(
      {Problem::Severity::kWarning,
       fmt::format("{}: the images have 16 bits a pixel, but no value is above {} in the {} pairs examined; "
                   "they are read as images of {} bits, and larger values as white",
                   sequence.folder.string(), (1 << bits) - 1, pairs, bits)});
}

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
  find_bits(scan);
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

RawPair load_raw_pair(const StereoSequence& sequence, std::size_t left, std::size_t right) {
  RawPair pair;
  if (sequence.source) {
    pair = read_source(sequence, left);
    if (right != left) pair.right = read_source(sequence, right).right;
  } else {
    pair = read_files(sequence, left, right);
  }
  if (sequence.right_half_first) std::swap(pair.left, pair.right);
  check_size(pair.left, sequence, left, /*is_left=*/true);
  check_size(pair.right, sequence, right, /*is_left=*/false);
  return pair;
}

bool has_one_image_twice(const StereoSequence& sequence, std::size_t index) {
  const auto pair = load_raw_pair(sequence, index, index);
  return pair.left.size() == pair.right.size() && cv::norm(pair.left, pair.right, cv::NORM_INF) == 0.0;
}

StereoFrame load_frame(const StereoSequence& sequence, std::size_t index, const ImageSettings& settings) {
  auto [left, right, stamp_ns] = load_raw_pair(sequence, index, index);
  StereoFrame frame{.index = index,
                    .stamp_ns = stamp_ns ? *stamp_ns : sequence.frames.at(index).stamp_ns,
                    .left = left,
                    .right = right};
  if (sequence.rectifier) {
    frame.left = sequence.rectifier->left(left);
    frame.right = sequence.rectifier->right(right);
  }
  equalise_contrast(frame, settings);
  return frame;
}

}  // namespace stereo_slam
