// SPDX-License-Identifier: MIT
#include "stereo_slam/bags/bag_files.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <system_error>

#include "stereo_slam/dataset/euroc.hpp"
#include "stereo_slam/dataset/kitti.hpp"
#include "stereo_slam/io/file_error.hpp"
#include "stereo_slam/io/text_file.hpp"

namespace stereo_slam {

namespace fs = std::filesystem;

bool has_bag_name(const fs::path& file) {
  const std::string name = lower_case(file.filename().string());
  constexpr std::array<std::string_view, 6> kEnds = {".bag", ".bag.active", ".mcap",
                                                     ".db3", ".mcap.zstd",  ".db3.zstd"};
  return std::ranges::any_of(kEnds, [&](std::string_view end) { return name.ends_with(end); });
}

bool is_bag_recording(const fs::path& recording) {
  std::error_code error;
  if (has_bag_name(recording)) return true;
  if (!fs::is_directory(recording, error) || looks_like_euroc(recording) || looks_like_kitti(recording))
    return false;
  for (const auto* images : {"left", "right"}) {
    if (fs::exists(recording / images, error)) return false;
  }
  const fs::directory_iterator files(recording, error);
  return !error && std::any_of(begin(files), end(files), [](const auto& file) {
    return has_bag_name(file.path()) && !file.path().filename().string().starts_with('.');
  });
}

std::vector<fs::path> bag_files(const fs::path& recording) {
  if (fs::is_directory(recording) && !has_bag_name(recording)) {
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(recording)) {
      const bool hidden = entry.path().filename().string().starts_with('.');
      if (!hidden && has_bag_name(entry.path())) files.push_back(entry.path());
    }
    if (files.empty()) fail(recording, "contains no bags");
    return files;
  }
  const std::string names = recording.string();
  if (fs::exists(recording) || names.find(',') == std::string::npos) return {recording};
  std::vector<fs::path> files;
  for (std::size_t begin = 0; begin <= names.size();) {
    const std::size_t end = std::min(names.find(',', begin), names.size());
    files.emplace_back(names.substr(begin, end - begin));
    begin = end + 1;
  }
  return files;
}

}  // namespace stereo_slam
