// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

/// Messages of ROS 2 in CDR, written for tests.
namespace stereo_slam::test {

/// Writes CDR of version 1 in either byte order.
class CdrWriter {
 public:
  explicit CdrWriter(bool big_endian)
      : bytes_{0, static_cast<std::uint8_t>(big_endian ? 0 : 1), 0, 0}, big_endian_(big_endian) {}

  template <class Number>
  CdrWriter& put(Number number) {
    while ((bytes_.size() - 4) % sizeof number != 0) bytes_.push_back(0);
    auto bytes = std::bit_cast<std::array<std::uint8_t, sizeof number>>(number);
    if (big_endian_) std::ranges::reverse(bytes);
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
    return *this;
  }

  CdrWriter& put_text(const std::string& text) {
    put(static_cast<std::uint32_t>(text.size() + 1));
    bytes_.insert(bytes_.end(), text.begin(), text.end());
    bytes_.push_back(0);
    return *this;
  }

  CdrWriter& put_header(std::int64_t stamp_ns, const std::string& frame) {
    constexpr std::int64_t kSecond_ns = 1'000'000'000;
    put(static_cast<std::int32_t>(stamp_ns / kSecond_ns));
    put(static_cast<std::uint32_t>(stamp_ns % kSecond_ns));
    return put_text(frame);
  }

  CdrWriter& put_bytes(const std::vector<std::uint8_t>& bytes) {
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
    return *this;
  }

  [[nodiscard]] std::vector<std::uint8_t> take() { return std::move(bytes_); }

 private:
  std::vector<std::uint8_t> bytes_;
  bool big_endian_;
};

/// A message as it is recorded.
struct TestMessage {
  std::string topic;
  std::string type;
  std::int64_t record_ns = 0;
  std::vector<std::uint8_t> bytes{};
};

/// A sensor_msgs/msg/Image.
struct CdrImage {
  std::int64_t stamp_ns = 0;
  std::string frame = "cam";
  std::uint32_t width = 3;
  std::uint32_t height = 2;
  std::uint32_t step = 4;
  std::string encoding = "mono8";
  std::vector<std::uint8_t> data = {0, 1, 2, 3, 4, 5, 6, 7};
  std::optional<std::uint32_t> declared_bytes{};  ///< the length before the data, if it is another
};

inline std::vector<std::uint8_t> cdr_image(const CdrImage& image, bool big_endian) {
  CdrWriter writer(big_endian);
  writer.put_header(image.stamp_ns, image.frame).put(image.height).put(image.width).put_text(image.encoding);
  writer.put(std::uint8_t{0}).put(image.step);
  writer.put(image.declared_bytes.value_or(static_cast<std::uint32_t>(image.data.size())));
  return writer.put_bytes(image.data).take();
}

/// A sensor_msgs/msg/CameraInfo of rectified images: those of the tiny recording, if nothing is set.
struct CdrCameraInfo {
  std::size_t coefficients = 5;
  std::uint32_t width = 320;
  std::uint32_t height = 120;
  double f = 200.0;
  double cx = 160.0;
  double cy = 60.0;
  double Tx = -80.0;  ///< P[3]
};

inline std::vector<std::uint8_t> cdr_camera_info(const CdrCameraInfo& info, bool big_endian) {
  CdrWriter writer(big_endian);
  writer.put_header(0, "cam").put(info.height).put(info.width).put_text("plumb_bob");
  writer.put(static_cast<std::uint32_t>(info.coefficients));
  for (std::size_t i = 1; i <= info.coefficients; ++i) writer.put(0.01 * static_cast<double>(i));
  for (const double k : {info.f, 0.0, info.cx, 0.0, info.f, info.cy, 0.0, 0.0, 1.0}) writer.put(k);
  for (const double r : {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0}) writer.put(r);
  for (const double p : {info.f, 0.0, info.cx, info.Tx, 0.0, info.f, info.cy, 0.0, 0.0, 0.0, 1.0, 0.0})
    writer.put(p);
  return writer.take();
}

/// A sensor_msgs/msg/Imu: rates and specific forces along x to z, and what begins their covariances.
struct CdrImu {
  std::int64_t stamp_ns = 0;
  std::array<double, 3> angular_velocity{};
  std::array<double, 3> linear_acceleration{};
  double angular_velocity_covariance = 0.0;
  double linear_acceleration_covariance = 0.0;
};

inline std::vector<std::uint8_t> cdr_imu(const CdrImu& imu, bool big_endian) {
  CdrWriter writer(big_endian);
  writer.put_header(imu.stamp_ns, "imu");
  const auto put_covariance = [&](double first) {
    writer.put(first);
    for (int i = 1; i < 9; ++i) writer.put(0.0);
  };
  for (const double q : {0.0, 0.0, 0.0, 1.0}) writer.put(q);
  put_covariance(-1.0);
  for (const double w : imu.angular_velocity) writer.put(w);
  put_covariance(imu.angular_velocity_covariance);
  for (const double a : imu.linear_acceleration) writer.put(a);
  put_covariance(imu.linear_acceleration_covariance);
  return writer.take();
}

}  // namespace stereo_slam::test
