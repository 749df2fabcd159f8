// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/grey_image.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <stdexcept>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

namespace stereo_slam {

cv::Mat to_grey(const cv::Mat& image) {
  const int channels = image.channels();
  if ((image.depth() != CV_8U && image.depth() != CV_16U) ||
      (channels != 1 && channels != 3 && channels != 4)) {
    throw std::invalid_argument(fmt::format(
        "an image of type {} is neither grey nor colour with 8 or 16 bits", cv::typeToString(image.type())));
  }
  cv::Mat bytes = image;
  if (image.depth() == CV_16U) image.convertTo(bytes, CV_8U, 1.0 / 256.0);
  if (channels == 1) return bytes.data == image.data ? image.clone() : bytes;
  cv::Mat grey;
  cv::cvtColor(bytes, grey, channels == 3 ? cv::COLOR_BGR2GRAY : cv::COLOR_BGRA2GRAY);
  return grey;
}

int used_bits(const cv::Mat& image) {
  double largest = 0.0;
  cv::minMaxLoc(image, nullptr, &largest);
  const int bits = std::bit_width(static_cast<std::uint16_t>(largest));
  return std::max(8, bits + bits % 2);
}

cv::Mat bytes_of_bits(const cv::Mat& image, int bits) {
  cv::Mat bytes;
  image.convertTo(bytes, CV_8U, std::ldexp(1.0, 8 - bits));
  return bytes;
}

void equalise_contrast(StereoFrame& frame, const ImageSettings& settings) {
  if (!settings.clahe) return;
  const auto clahe = cv::createCLAHE(settings.clahe_clip_limit, {settings.clahe_tiles, settings.clahe_tiles});
  for (cv::Mat* image : {&frame.left, &frame.right}) {
    cv::Mat result;
    clahe->apply(*image, result);
    *image = result;
  }
}

}  // namespace stereo_slam
