// SPDX-License-Identifier: MIT
#include "stereo_slam/bags/ros_message.hpp"

#include "stereo_slam/support/cdr.hpp"
#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

namespace {

constexpr std::int64_t kStamp_ns = 1'500'000'000'123'456'789;
constexpr std::uint32_t kNoneOfRos2 = 0xFFFFFFFF;

[[nodiscard]] RosMessage cdr(const std::string& type, std::span<const std::uint8_t> bytes) {
  return {.type = "sensor_msgs/msg/" + type, .serialization = Serialization::kCdr, .bytes = bytes};
}

[[nodiscard]] std::string error_in(const std::vector<std::uint8_t>& image) {
  return message_of([&] { (void)read_grey(cdr("Image", image), {}); });
}

}  // namespace

TEST_CASE("Images in CDR of either byte order have the pixels of their message", "[bags]") {
  for (const bool big_endian : {false, true}) {
    CAPTURE(big_endian);
    for (const std::string frame : {"", "a", "cam", "camera"}) {  // which shift the fields behind them
      CAPTURE(frame);
      const auto bytes =
          cdr_image({.stamp_ns = kStamp_ns, .frame = frame, .width = 3, .height = 2, .step = 4}, big_endian);
      const auto message = cdr("Image", bytes);
      CHECK(header_stamp_ns(message) == kStamp_ns);
      CHECK(header_stamp_ns(cdr("Image", std::span(bytes).first(kStampedBytes))) == kStamp_ns);
      const cv::Mat grey = read_grey(message, {});
      REQUIRE(grey.size() == cv::Size(3, 2));
      CHECK(grey.at<std::uint8_t>(1, 2) == 6);  // rows may be padded
    }
  }
}

TEST_CASE("A stamp before 1970 is possible in ROS 2", "[bags]") {
  CHECK(header_stamp_ns(cdr("Image", cdr_image({.stamp_ns = -5'000'000'000}, false))) == -5'000'000'000);
}

TEST_CASE("A camera_info of ROS 2 is that of ROS 1 in CDR", "[bags]") {
  for (const bool big_endian : {false, true}) {
    for (const std::size_t coefficients : {0, 4, 5}) {
      CAPTURE(big_endian, coefficients);
      const auto info =
          read_camera_info(cdr("CameraInfo", cdr_camera_info({.coefficients = coefficients}, big_endian)));
      CHECK(info.width_px == 320.0);
      CHECK(info.height_px == 120.0);
      CHECK(info.distortion_model == "plumb_bob");
      REQUIRE(info.D.size() == coefficients);
      if (coefficients > 0) CHECK(info.D.back() == Approx(0.01 * static_cast<double>(coefficients)));
      CHECK(info.K[0] == 200.0);
      CHECK(info.R[8] == 1.0);
      CHECK(info.P[3] == -80.0);
    }
  }
}

TEST_CASE("Images in CDR that cannot be are refused in one sentence", "[bags]") {
  CHECK_THAT(error_in(cdr_image({.width = 0, .height = 0, .step = 0, .data = {}}, false)),
             Catch::Contains("has 0 x 0 pixels, it is empty"));
  CHECK_THAT(error_in(cdr_image({.step = 4000}, false)), Catch::Contains("truncated"));
  CHECK_THAT(error_in(cdr_image({.step = 1}, false)), Catch::Contains("a row (step) has 1 byte, but"));
  CHECK_THAT(error_in(cdr_image({.encoding = "32FC1"}, false)),
             Catch::Contains("the encoding '32FC1' is not known"));
  CHECK_THAT(error_in(cdr_image({.width = kNoneOfRos2, .height = kNoneOfRos2}, false)),
             Catch::Contains("images may have up to"));
  CHECK_THAT(error_in(cdr_image({.declared_bytes = kNoneOfRos2}, false)),
             Catch::Contains("a message ends within its fields"));
  CHECK_THAT(error_in({0x00, 0x07, 0, 0, 0, 0, 0, 0}), Catch::Contains("the representation 0007 of CDR"));
  CHECK_THAT(error_in({}), Catch::Contains("a message ends within its fields"));
  CHECK_THAT(message_of([&] {
               (void)read_camera_info(cdr("CameraInfo", cdr_camera_info({.coefficients = 99}, true)));
             }),
             Catch::Contains("too many distortion coefficients"));
}

TEST_CASE("Every beginning of a message is refused, or read as what it is", "[bags]") {
  const auto image = cdr_image({}, true);
  const auto info = cdr_camera_info({.coefficients = 5}, false);
  for (std::size_t size = 0; size < image.size(); ++size)
    CHECK_FALSE(error_in({image.begin(), image.begin() + static_cast<std::ptrdiff_t>(size)}).empty());
  for (std::size_t size = 0; size < info.size(); ++size) {
    CHECK_THROWS_AS(read_camera_info(cdr("CameraInfo", std::span(info).first(size))), std::invalid_argument);
  }
}

TEST_CASE("Serializations are known by their names, and others are named", "[bags]") {
  CHECK(serialization_of("cdr") == Serialization::kCdr);
  CHECK(serialization_of("ros1") == Serialization::kRos1);
  CHECK_THAT(message_of([] { (void)serialization_of("protobuf"); }),
             Catch::Contains("is serialised as 'protobuf', which is not read"));
}
