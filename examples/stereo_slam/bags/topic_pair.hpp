// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

/// Which topics of a bag are those of the two cameras and of the IMU.
namespace stereo_slam {

struct BagTopic {
  std::string name;
  std::string type;  ///< "sensor_msgs/Image", or "sensor_msgs/msg/Image" in ROS 2
  std::size_t messages = 0;
  std::string serialization{};  ///< the bag's name for it; see serialization_of()
  double rate_hz = 0.0;         ///< messages a second on average, by the times of recording; 0 if unknown
};

/// Whether the type of a topic is this one of the package sensor_msgs.
[[nodiscard]] bool is_sensor_type(std::string_view type, std::string_view name);

/// "/cam0/image_raw/compressed" -> "/cam0/image_raw".
[[nodiscard]] std::string without_transport(std::string image_topic);

/// The names of the image topics of the left and the right camera; the same if its images show both.
struct TopicPair {
  std::string left;
  std::string right;
  bool is_guess = false;    ///< their names do not say that they are left and right
  bool is_unnamed = false;  ///< nor do they number them: only a calibration can tell which is left

  [[nodiscard]] bool side_by_side() const { return left == right; }
};

/// The topics named `left` and `right`, or, if these are empty, the only pair with messages whose names
/// differ by left and right, cam0 and cam1, camera0 and camera1, or infra1 and infra2; else the only one
/// whose names differ by l and r, a and b, port and starboard, or a number and the next. Throws
/// std::invalid_argument, listing the candidates, when there is no pair or more than one. A compressed copy
/// of an image topic is no other topic.
[[nodiscard]] TopicPair choose_topics(const std::vector<BagTopic>& topics, const std::string& left = "",
                                      const std::string& right = "");

/// The topic of sensor_msgs/Imu named `name`, or, if that is empty, the only one with messages. Throws
/// std::invalid_argument, listing the candidates, when there is none or more than one.
[[nodiscard]] std::string choose_imu_topic(const std::vector<BagTopic>& topics, const std::string& name = "");

/// Throws std::invalid_argument: that there are no pairs of image topics, listing those there are.
[[noreturn]] void refuse_topics(const std::vector<BagTopic>& topics);

}  // namespace stereo_slam
