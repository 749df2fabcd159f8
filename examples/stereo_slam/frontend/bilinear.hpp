// SPDX-License-Identifier: MIT
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>

#include <opencv2/core.hpp>

#include "stereo_slam/frontend/patch_pixels.hpp"

namespace stereo_slam {

/// Whether a position is at least `margin_px` inside an image; false for NaN.
[[nodiscard]] inline bool inside(const cv::Mat& image, double x, double y, double margin_px) {
  return x >= margin_px && y >= margin_px && x < image.cols - 1 - margin_px && y < image.rows - 1 - margin_px;
}

/// Grey value of an 8-bit image between its pixels; the position must be inside.
[[nodiscard]] inline float bilinear(const cv::Mat& image, float x, float y) {
  const int x0 = static_cast<int>(x);
  const int y0 = static_cast<int>(y);
  const float ax = x - static_cast<float>(x0);
  const float ay = y - static_cast<float>(y0);
  const std::uint8_t* upper = image.ptr<std::uint8_t>(y0) + x0;
  const std::uint8_t* lower = upper + image.step;
  const float top = static_cast<float>(upper[0]) + ax * static_cast<float>(upper[1] - upper[0]);
  const float bottom = static_cast<float>(lower[0]) + ax * static_cast<float>(lower[1] - lower[0]);
  return top + ay * (bottom - top);
}

/// Four grey values, converted to float.
[[nodiscard]] inline FourFloats four_floats(const std::uint8_t* pixels) {
  using FourBytes [[gnu::vector_size(4)]] = std::uint8_t;
  FourBytes four;
  std::memcpy(&four, pixels, sizeof four);
  return __builtin_convertvector(four, FourFloats);
}

/// bilinear() at four positions, with bit-identical results. Faster if the four positions lie in consecutive
/// pixels of a row, from left to right.
[[nodiscard]] inline FourFloats bilinear(const cv::Mat& image, FourFloats x, FourFloats y) {
  const auto x0 = __builtin_convertvector(x, FourInts);
  const auto y0 = __builtin_convertvector(y, FourInts);
  const FourFloats ax = x - __builtin_convertvector(x0, FourFloats);
  const FourFloats ay = y - __builtin_convertvector(y0, FourFloats);
  const auto in_a_row = (x0 == x0[0] + FourInts{0, 1, 2, 3}) & (y0 == y0[0]);
  if ((in_a_row[0] & in_a_row[1] & in_a_row[2] & in_a_row[3]) != 0) {
    const std::uint8_t* pixel = image.ptr<std::uint8_t>(y0[0]) + x0[0];
    const std::uint8_t* below = pixel + image.step;
    const FourFloats left = four_floats(pixel), left_below = four_floats(below);
    const FourFloats top = left + ax * (four_floats(pixel + 1) - left);
    const FourFloats bottom = left_below + ax * (four_floats(below + 1) - left_below);
    return top + ay * (bottom - top);
  }
  FourInts upper{}, lower{};  // of each position two neighbouring grey values: the left one in the low byte
  static_assert(std::endian::native == std::endian::little);
  for (int i = 0; i < 4; ++i) {
    const std::uint8_t* pixel = image.ptr<std::uint8_t>(y0[i]) + x0[i];
    std::uint16_t two = 0;
    std::memcpy(&two, pixel, sizeof two);
    upper[i] = two;
    std::memcpy(&two, pixel + image.step, sizeof two);
    lower[i] = two;
  }
  const auto left = [](FourInts two) { return __builtin_convertvector(two & 255, FourFloats); };
  const auto right = [](FourInts two) { return __builtin_convertvector(two >> 8, FourFloats); };
  const FourFloats top = left(upper) + ax * (right(upper) - left(upper));
  const FourFloats bottom = left(lower) + ax * (right(lower) - left(lower));
  return top + ay * (bottom - top);
}

}  // namespace stereo_slam
