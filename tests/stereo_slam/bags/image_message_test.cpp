// SPDX-License-Identifier: MIT
#include "stereo_slam/bags/image_message.hpp"

#include <cmath>
#include <string>

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

TEST_CASE("Colours of 16 bits are weighted, and then reduced as grey of 16 bits is", "[bags]") {
  // Two pixels: 0x1234, 0x4567, 0x89AB and 0xFFFF three times, little and big endian.
  const std::vector<std::uint8_t> little = {0x34, 0x12, 0x67, 0x45, 0xAB, 0x89,
                                            0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF};
  const std::vector<std::uint8_t> big = {0x12, 0x34, 0x45, 0x67, 0x89, 0xAB,
                                         0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF};
  // The weights of ITU-R BT.601; OpenCV has them as integers of 14 or 15 bits: within one value of 65536.
  const double of_rgb = .299 * 0x1234 + .587 * 0x4567 + .114 * 0x89AB;
  const double of_bgr = .114 * 0x1234 + .587 * 0x4567 + .299 * 0x89AB;
  ImageMessage message{
      .width = 2, .height = 1, .step = 12, .encoding = "rgb16", .big_endian = false, .data = little};
  CHECK(std::abs(values_of_16(message).at<std::uint16_t>(0, 0) - of_rgb) <= 2.0);
  CHECK(values_of_16(message).at<std::uint16_t>(0, 1) == 0xFFFF);
  CHECK(std::abs(to_grey(message).at<std::uint8_t>(0, 0) - of_rgb / 256.0) <= 0.51);
  CHECK(std::abs(to_grey(message, {.black = 10000.0, .step = 64.0}).at<std::uint8_t>(0, 0) -
                 (of_rgb - 10000.0) / 64.0) <= 0.55);
  message.big_endian = true;
  message.data = big;
  CHECK(std::abs(values_of_16(message).at<std::uint16_t>(0, 0) - of_rgb) <= 2.0);
  for (const char* bgr : {"bgr16", "16UC3"}) {
    message.encoding = bgr;
    CHECK(std::abs(values_of_16(message).at<std::uint16_t>(0, 0) - of_bgr) <= 2.0);
  }
  message.width = 1;  // the second pixel begins with the alpha of the first one
  for (const char* bgra : {"bgra16", "16UC4"}) {
    message.encoding = bgra;
    CHECK(std::abs(values_of_16(message).at<std::uint16_t>(0, 0) - of_bgr) <= 2.0);
  }
  message.encoding = "rgba16";
  CHECK(std::abs(values_of_16(message).at<std::uint16_t>(0, 0) - of_rgb) <= 2.0);
  message.width = 2;
  CHECK_THAT(message_of([&] { (void)to_grey(message); }),
             Catch::Contains("a row (step) has 12 bytes, but its 2 pixels of rgba16 take 16"));
}

TEST_CASE("A Bayer pattern of 16 bits is read as the same of 8 bits", "[bags]") {
  // Squares of a colour of its own each, so that a pattern read as another one has other grey levels.
  constexpr std::uint32_t kWidth = 12;
  constexpr std::uint32_t kHeight = 8;
  struct Pattern {
    const char* name;
    const char* colours;  ///< of row 0 and row 1, columns 0 and 1
  };
  constexpr auto kRed = 0x3000;
  constexpr auto kGreen = 0x9000;
  constexpr auto kBlue = 0xF000;
  const double grey = .299 * kRed + .587 * kGreen + .114 * kBlue;
  for (const auto& [name, colours] : {Pattern{"bayer_rggb", "rggb"}, Pattern{"bayer_bggr", "bggr"},
                                      Pattern{"bayer_gbrg", "gbrg"}, Pattern{"bayer_grbg", "grbg"}}) {
    CAPTURE(name);
    std::vector<std::uint8_t> bytes8;
    std::vector<std::uint8_t> bytes16;
    for (std::uint32_t y = 0; y < kHeight; ++y) {
      for (std::uint32_t x = 0; x < kWidth; ++x) {
        const char colour = colours[2 * (y % 2) + x % 2];
        const int value = colour == 'r' ? kRed : colour == 'g' ? kGreen : kBlue;
        bytes8.push_back(static_cast<std::uint8_t>(value / 256));
        bytes16.push_back(0);
        bytes16.push_back(static_cast<std::uint8_t>(value / 256));
      }
    }
    const ImageMessage of_8{.width = kWidth,
                            .height = kHeight,
                            .step = kWidth,
                            .encoding = std::string(name) + "8",
                            .big_endian = false,
                            .data = bytes8};
    ImageMessage of_16 = of_8;
    of_16.encoding = std::string(name) + "16";
    of_16.step = 2 * kWidth;
    of_16.data = bytes16;
    CHECK(values_of_16(of_8).empty());
    CHECK(cv::norm(to_grey(of_8), to_grey(of_16), cv::NORM_INF) <= 1.0);  // rounded in another order
    CHECK(std::abs(values_of_16(of_16).at<std::uint16_t>(3, 3) - grey) <= 3.0);
  }
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
