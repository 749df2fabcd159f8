// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>

namespace stereo_slam {

/// The definition of a message type of ROS 2, such as "nav_msgs/msg/Odometry", with those of the types that
/// it contains: what MCAP calls ros2msg. Throws std::invalid_argument for a type that is not written here.
[[nodiscard]] std::string ros2_definition(std::string_view type);

}  // namespace stereo_slam
