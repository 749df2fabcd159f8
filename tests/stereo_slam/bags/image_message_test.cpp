// SPDX-License-Identifier: MIT
#include "stereo_slam/bags/image_message.hpp"

#include "stereo_slam/support/support.hpp"
#include "support/catch.hpp"

using namespace stereo_slam;
using namespace stereo_slam::test;

TEST_CASE("Images of messages are checked against their size", "[bags]") {
  std::vector<std::uint8_t> data(64);
  for (std::size_t i = 0; i < data.size(); ++i) data[i] = static_cast<std::uint8_t>(i);
  const ImageMessage good{
      .width = 8, .height = 4, .step = 16, .encoding = "mono8", .big_endian = false, .data = data};
  CHECK(to_grey(good).at<std::uint8_t>(3, 7) == 55);  // rows may be padded
  auto message = good;
  message.encoding = "mono16";
  CHECK(to_grey(message).at<std::uint8_t>(1, 2) == 21);
  message.big_endian = true;
  CHECK(to_grey(message).at<std::uint8_t>(1, 2) == 20);
  ValueCounts values;
  values.add(values_of_16(message));
  CHECK(values.bits() == 14);  // the largest value is 0x3E3F
  CHECK(to_grey(message, GreyScale::of_bits(14)).at<std::uint8_t>(1, 2) == 80);
  CHECK(values_of_16(good).empty());
  message.encoding = "bgr8";
  CHECK_THAT(message_of([&] { (void)to_grey(message); }),
             Catch::Contains("a row (step) has 16 bytes, but its 8 pixels of bgr8 take 24"));
  message = good;
  message.height = 5;
  CHECK_THAT(message_of([&] { (void)to_grey(message); }), Catch::Contains("truncated"));
  message.width = message.height = 0xFFFFFFFF;
  CHECK_THAT(message_of([&] { (void)to_grey(message); }), Catch::Contains("images may have up to"));
  message = good;
  message.width = 0;
  CHECK_THAT(message_of([&] { (void)to_grey(message); }), Catch::Contains("has 0 x 4 pixels, it is empty"));
  for (const char* bayer : {"bayer_rggb8", "bayer_bggr8", "bayer_gbrg8", "bayer_grbg8"}) {
    message = good;
    message.encoding = bayer;
    CHECK(to_grey(message).size() == cv::Size(8, 4));
  }
  CHECK_THAT(message_of([] {
               (void)decode_grey(std::vector<std::uint8_t>{1, 2, 3});
             }),
             Catch::Contains("cannot be decoded"));
  std::vector<std::uint8_t> jpeg;
  cv::imencode(".jpg", tiny_texture(64), jpeg);
  CHECK(decode_grey(jpeg).cols == 64);
  jpeg.erase(jpeg.begin() + static_cast<std::ptrdiff_t>(jpeg.size() / 2), jpeg.end() - 200);
  CHECK_THAT(message_of([&] { (void)decode_grey(jpeg); }), Catch::Contains("the JPEG is damaged"));
}

TEST_CASE("The grey values of a YUV image are where its encoding has them", "[bags]") {
  std::vector<std::uint8_t> data(24);
  for (std::size_t i = 0; i < data.size(); ++i) data[i] = static_cast<std::uint8_t>(10 * i);
  struct Grey {
    const char* encoding;
    std::uint32_t step;
    int value;  ///< of row 1, column 2
  };
  for (const auto& [encoding, step, value] :
       {Grey{"yuv422", 8, 130}, Grey{"uyvy", 8, 130}, Grey{"yuv422_yuy2", 8, 120}, Grey{"yuyv", 8, 120},
        Grey{"nv12", 4, 60}, Grey{"nv21", 4, 60}}) {
    CAPTURE(encoding);
    const ImageMessage message{
        .width = 4, .height = 2, .step = step, .encoding = encoding, .big_endian = false, .data = data};
    const cv::Mat grey = to_grey(message);
    REQUIRE(grey.size() == cv::Size(4, 2));
    CHECK(grey.at<std::uint8_t>(1, 2) == value);
  }
}
