// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <vector>

/// Which files are a recording in bags.
namespace stereo_slam {

/// Whether the extension is that of a bag: .mcap or .db3 of ROS 2, also packed (.zstd); .bag of ROS 1, or
/// .bag.active of one whose recording was not ended.
[[nodiscard]] bool has_bag_name(const std::filesystem::path& file);

/// Whether it is a bag, the parts of one as BAG,BAG,..., or a folder that contains bags and no other
/// recording.
[[nodiscard]] bool is_bag_recording(const std::filesystem::path& recording);

/// The files of a recording: a bag; the parts of one as BAG,BAG,...; or those in a folder. Throws
/// std::runtime_error if a folder contains none.
[[nodiscard]] std::vector<std::filesystem::path> bag_files(const std::filesystem::path& recording);

}  // namespace stereo_slam
