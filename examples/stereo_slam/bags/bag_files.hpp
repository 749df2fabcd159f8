// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <vector>

/// Which files are a recording in bags.
namespace stereo_slam {

/// Whether the extension is that of a bag: .mcap or .db3 of ROS 2, also packed (.zstd); .bag of ROS 1, or
/// .bag.active of one whose recording was not ended.
[[nodiscard]] bool has_bag_name(const std::filesystem::path& file);

/// Whether it is a bag, the parts of one as BAG,BAG,..., or a folder that contains bags, or rosbag2's
/// metadata.yaml, and no other recording.
[[nodiscard]] bool is_bag_recording(const std::filesystem::path& recording);

/// The files of a recording.
struct BagFiles {
  std::vector<std::filesystem::path> files;
  bool are_parts = false;                        ///< metadata.yaml says so; otherwise their times have to
  std::vector<std::filesystem::path> unnamed{};  ///< bags in the folder that metadata.yaml does not name
};

/// Those of a bag; of the parts of one as BAG,BAG,...; of a folder: the files that its metadata.yaml names,
/// or all bags in it. Throws std::runtime_error if a folder contains none, or not those that metadata.yaml
/// names.
[[nodiscard]] BagFiles bag_files(const std::filesystem::path& recording);

}  // namespace stereo_slam
