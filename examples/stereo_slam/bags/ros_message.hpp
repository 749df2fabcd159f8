// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include <opencv2/core.hpp>

#include "stereo_slam/bags/message_fields.hpp"
#include "stereo_slam/calibration/camera_info.hpp"
#include "stereo_slam/core/imu_readings.hpp"
#include "stereo_slam/images/grey_image.hpp"

namespace stereo_slam {

/// A message as it was recorded. The functions that read one throw std::invalid_argument if it is damaged.
struct RosMessage {
  std::string type;  ///< see BagTopic
  Serialization serialization = Serialization::kRos1;
  std::span<const std::uint8_t> bytes;
};

/// The stamp of a message that begins with a header; its first kStampedBytes are enough.
[[nodiscard]] std::int64_t header_stamp_ns(const RosMessage& message);

/// A sensor_msgs/Image or CompressedImage as CV_8UC1; see to_grey() and decode_grey().
[[nodiscard]] cv::Mat read_grey(const RosMessage& message, const GreyScale& scale);

/// Such an image as CV_16UC1 if it has 16 bits a pixel; otherwise empty.
[[nodiscard]] cv::Mat read_16_bit(const RosMessage& message);

/// A sensor_msgs/Imu, with the stamp of its header. Throws std::invalid_argument also if it says that it has
/// no rates or no specific forces, or if its numbers cannot be those of a sensor.
[[nodiscard]] ImuSample read_imu_sample(const RosMessage& message);

/// A sensor_msgs/CameraInfo.
[[nodiscard]] CameraInfo read_camera_info(const RosMessage& message);

}  // namespace stereo_slam
