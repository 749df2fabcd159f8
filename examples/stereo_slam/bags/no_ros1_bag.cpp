// SPDX-License-Identifier: MIT
// In place of ros1_bag.cpp where librosbag-storage-dev is missing: bags of ROS 1 are refused.

#include <stdexcept>

#include "stereo_slam/bags/message_file.hpp"

namespace stereo_slam {

std::unique_ptr<MessageFile> open_ros1_bag(const std::filesystem::path& /*file*/) {
  throw std::runtime_error(
      "this program was built without bags of ROS 1; install librosbag-storage-dev and build it again");
}

}  // namespace stereo_slam
