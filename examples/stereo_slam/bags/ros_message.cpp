// SPDX-License-Identifier: MIT
#include "stereo_slam/bags/ros_message.hpp"

#include <array>
#include <cstddef>
#include <stdexcept>
#include <string>

#include <fmt/format.h>

#include "stereo_slam/bags/image_message.hpp"
#include "stereo_slam/bags/topic_pair.hpp"
#include "stereo_slam/images/image_size.hpp"

namespace stereo_slam {
namespace {

[[nodiscard]] bool is_compressed(const RosMessage& message) {
  return is_sensor_type(message.type, "CompressedImage");
}

/// Reads a sensor_msgs/Image. The pixels belong to the message.
[[nodiscard]] ImageMessage raw_image(const RosMessage& message) {
  MessageFields fields(message.bytes, message.serialization);
  fields.skip_header();
  ImageMessage image;
  image.height = fields.next<std::uint32_t>();
  image.width = fields.next<std::uint32_t>();
  image.encoding = fields.text();
  image.big_endian = fields.next<std::uint8_t>() != 0;
  image.step = fields.next<std::uint32_t>();
  image.data = fields.bytes();
  return image;
}

/// Reads a sensor_msgs/CompressedImage. The bytes belong to the message.
[[nodiscard]] std::span<const std::uint8_t> compressed_image(const RosMessage& message) {
  MessageFields fields(message.bytes, message.serialization);
  fields.skip_header();
  const std::string format = fields.text();
  const auto bytes = fields.bytes();
  if (image_size(bytes)) return bytes;  // by its contents; the format is not always right
  throw std::invalid_argument(fmt::format(
      "the compressed image of format '{}' is damaged, or is none that is decoded; record JPEG or PNG",
      format));
}

}  // namespace

std::int64_t header_stamp_ns(const RosMessage& message) {
  return MessageFields(message.bytes, message.serialization).stamp_ns();
}

cv::Mat read_grey(const RosMessage& message, const GreyScale& scale) {
  return is_compressed(message) ? decode_grey(compressed_image(message), scale)
                                : to_grey(raw_image(message), scale);
}

cv::Mat read_16_bit(const RosMessage& message) {
  return is_compressed(message) ? decode_16_bit(compressed_image(message)) : values_of_16(raw_image(message));
}

ImuSample read_imu_sample(const RosMessage& message) {
  constexpr std::size_t kOrientation = 4, kCovariance = 9;
  MessageFields fields(message.bytes, message.serialization);
  ImuSample sample;
  sample.stamp_ns = MessageFields(fields).stamp_ns();
  fields.skip_header();
  std::array<double, kOrientation + kCovariance> orientation{};
  fields.fill(orientation);  // drivers estimate it by gravity, rates and a compass
  const auto next = [&](const char* name) -> Eigen::Vector3d {
    std::array<double, 3> vector{};
    std::array<double, kCovariance> covariance{};
    fields.fill(vector);
    fields.fill(covariance);
    if (covariance[0] == -1.0) {  // as the definition of the message has it
      throw std::invalid_argument(
          fmt::format("{0}_covariance[0] is -1, which says that there is no {0}; name a topic with rates and "
                      "specific forces",
                      name));
    }
    return {vector[0], vector[1], vector[2]};
  };
  sample.angular_velocity = next("angular_velocity");
  sample.specific_force = next("linear_acceleration");
  if (!is_plausible(sample)) throw std::invalid_argument("the readings are not six numbers within 100000");
  return sample;
}

CameraInfo read_camera_info(const RosMessage& message) {
  constexpr std::uint32_t kMostCoefficients = 14;  // of OpenCV's models
  MessageFields fields(message.bytes, message.serialization);
  fields.skip_header();
  CameraInfo info;
  info.height_px = fields.next<std::uint32_t>();
  info.width_px = fields.next<std::uint32_t>();
  info.distortion_model = fields.text();
  const auto count = fields.next<std::uint32_t>();
  if (count > kMostCoefficients)
    throw std::invalid_argument("the camera_info has too many distortion coefficients");
  info.D.resize(count);
  fields.fill(info.D);
  fields.fill(info.K);
  fields.fill(info.R);
  fields.fill(info.P);
  return info;
}

}  // namespace stereo_slam
