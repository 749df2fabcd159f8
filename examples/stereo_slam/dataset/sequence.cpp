// SPDX-License-Identifier: MIT
#include "dataset/sequence.hpp"

#include <algorithm>
#include <stdexcept>

#include <fmt/format.h>

#include "dataset/image_file.hpp"
#include "dataset/kitti.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

SequenceScan unusable(const fs::path& folder, std::string text) {
  SequenceScan scan;
  scan.sequence.folder = folder;
  scan.problems.push_back({Problem::Severity::kError, std::move(text)});
  return scan;
}

cv::Mat load_checked(const fs::path& file, const StereoCamera& camera) {
  cv::Mat image = load_gray_png(file);
  if (image.cols != camera.width_px || image.rows != camera.height_px) {
    throw std::runtime_error(wrong_size(file, image.cols, image.rows, camera).text);
  }
  return image;
}

}  // namespace

SequenceScan scan_sequence(const fs::path& folder, std::string_view format) {
  const std::string name = folder.string();
  if (!fs::exists(folder)) return unusable(folder, fmt::format("{}: no such folder; check --dataset", name));
  if (!fs::is_directory(folder))
    return unusable(folder, fmt::format("{}: is not a folder; check --dataset", name));
  if (format == "kitti" || (format == "auto" && looks_like_kitti(folder))) return scan_kitti(folder);
  if (format == "euroc" || fs::is_directory(folder / "mav0")) {
    return unusable(
        folder, fmt::format("{}: EuRoC recordings are not supported yet; rectify and convert to the KITTI "
                            "layout ({})",
                            name, kKittiLayout));
  }
  return unusable(folder,
                  fmt::format("{}: no known recording; expected the KITTI layout ({})", name, kKittiLayout));
}

StereoSequence open_sequence(const fs::path& folder, std::string_view format) {
  SequenceScan scan = scan_sequence(folder, format);
  const auto error = std::find_if(scan.problems.begin(), scan.problems.end(), is_error);
  if (error != scan.problems.end()) throw std::runtime_error(error->text);
  return std::move(scan.sequence);
}

Problem wrong_size(const fs::path& file, int width_px, int height_px, const StereoCamera& camera) {
  return {Problem::Severity::kError,
          fmt::format("{}: is {}x{} pixels where the sequence has {}x{}; all images must have one size",
                      file.string(), width_px, height_px, camera.width_px, camera.height_px)};
}

StereoFrame load_frame(const StereoSequence& sequence, std::size_t index) {
  const auto& files = sequence.frames.at(index);
  return {.index = index,
          .stamp_ns = files.stamp_ns,
          .left = load_checked(files.left, sequence.camera),
          .right = load_checked(files.right, sequence.camera)};
}

}  // namespace stereo_slam
