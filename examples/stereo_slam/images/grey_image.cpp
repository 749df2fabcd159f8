// SPDX-License-Identifier: MIT
#include "stereo_slam/images/grey_image.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numeric>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

namespace stereo_slam {

namespace {

constexpr double kClaheClipLimit = 3.0;  // of the contrast gain
constexpr int kClaheTiles = 8;           // per side of the image

/// A CV_16UC1 image whose values have their two bytes exchanged.
cv::Mat with_exchanged_bytes(const cv::Mat& image) {
  std::array<cv::Mat, 2> bytes;
  cv::split(cv::Mat(image.rows, image.cols, CV_8UC2, image.data, image.step), bytes.data());
  std::swap(bytes[0], bytes[1]);
  cv::Mat exchanged;
  cv::merge(bytes.data(), bytes.size(), exchanged);
  return cv::Mat(image.rows, image.cols, CV_16UC1, exchanged.data, exchanged.step).clone();
}

/// The mean difference of values beside each other in units of the mean difference from the mean: 4/3 for
/// independent values that are evenly distributed, and zero for an image of one value.
double roughness_of(const cv::Mat& image) {
  if (image.cols < 2) return 0.0;
  cv::Mat values, differences;
  image.convertTo(values, CV_32F);
  cv::absdiff(values.colRange(1, values.cols), values.colRange(0, values.cols - 1), differences);
  const double contrast = cv::mean(cv::abs(values - cv::mean(values)[0]))[0];
  return contrast > 0.0 ? cv::mean(differences)[0] / contrast : 0.0;
}

}  // namespace

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

GreyScale GreyScale::of_bits(int bits) { return {.black = 0.0, .step = std::ldexp(1.0, bits - 8)}; }

cv::Mat to_grey(const cv::Mat& image, const GreyScale& scale) {
  constexpr double kMediumGrey = 128.0;
  constexpr double kHalf = 0.5;
  double black = scale.black;
  if (scale.by_median) {
    ValueCounts values;
    values.add(image);
    black = values.quantile(kHalf) - kMediumGrey * scale.step;
  }
  cv::Mat grey;
  image.convertTo(grey, CV_8U, 1.0 / scale.step, -black / scale.step);
  return grey;
}

void ValueCounts::add(const cv::Mat& image) {
  ValueCounts one;
  one.count(image);
  ranges_.push_back(one.quantile(1.0 - kTail) - one.quantile(kTail));
  largest_ = std::max(largest_, one.largest_);
  std::ranges::transform(counts_, one.counts_, counts_.begin(), std::plus<>());
  roughness_ += roughness_of(image);
  exchanged_roughness_ += roughness_of(with_exchanged_bytes(image));
}

void ValueCounts::count(const cv::Mat& image) {
  constexpr int kEnoughRows = 500;  // so that a single one counts less than kTail
  const int step_px = std::max(1, image.rows / kEnoughRows);
  cv::minMaxLoc(image, nullptr, &largest_);
  for (int y = 0; y < image.rows; y += step_px) {
    const auto* row = image.ptr<std::uint16_t>(y);
    for (int x = 0; x < image.cols; ++x) ++counts_[row[x]];
  }
}

int ValueCounts::bits() const {
  const int bits = std::bit_width(static_cast<std::uint16_t>(largest_));
  return std::max(8, bits + bits % 2);
}

double ValueCounts::quantile(double share) const {
  const auto all = static_cast<double>(std::accumulate(counts_.begin(), counts_.end(), std::uint64_t{0}));
  double below = 0.0;
  for (std::size_t value = 0; value < counts_.size(); ++value) {
    below += static_cast<double>(counts_[value]);
    if (below >= share * all) return static_cast<double>(value);
  }
  return largest_;
}

double ValueCounts::range_of_one() const {
  if (ranges_.empty()) return 0.0;
  auto ranges = ranges_;
  const auto middle = ranges.begin() + static_cast<std::ptrdiff_t>(ranges.size() / 2);
  std::nth_element(ranges.begin(), middle, ranges.end());
  return *middle;
}

bool ValueCounts::have_exchanged_bytes() const {
  constexpr double kClearlyLess = 0.5;
  return exchanged_roughness_ < kClearlyLess * roughness_;
}

GreyScale ValueCounts::scale() const {
  constexpr double kEnough = 64.0;  // grey levels; with half as many, KITTI 06 is lost
  constexpr double kLevels = 256.0;
  constexpr double kMuchMore = 1.5;
  const GreyScale plain = GreyScale::of_bits(bits());
  const double low = quantile(kTail);
  const double high = quantile(1.0 - kTail);
  const double one = range_of_one();
  const bool by_median = high - low > kMuchMore * one;
  const double range = by_median ? one : high - low;
  const double step = std::max(1.0, 2.0 * range / kLevels);
  if (range >= kEnough * plain.step || step >= plain.step) return plain;
  if (by_median) return {.black = 0.0, .step = step, .by_median = true};
  return {.black = 0.5 * (low + high) - 0.5 * kLevels * step, .step = step};
}

Alternation alternation_of(const cv::Mat& image) {
  if (image.rows < 3 || image.cols < 3) return {};
  const auto mean_difference = [](const cv::Mat& a, const cv::Mat& b) {
    cv::Mat difference;
    cv::absdiff(a, b, difference);
    return cv::mean(difference)[0];
  };
  const auto rows_apart = [&](int apart) {
    return mean_difference(image.rowRange(0, image.rows - apart), image.rowRange(apart, image.rows));
  };
  const auto columns_apart = [&](int apart) {
    return mean_difference(image.colRange(0, image.cols - apart), image.colRange(apart, image.cols));
  };
  const double rows = rows_apart(2), columns = columns_apart(2);
  return {.rows = rows > 0.0 ? rows_apart(1) / rows : 0.0,
          .columns = columns > 0.0 ? columns_apart(1) / columns : 0.0};
}

void equalise_contrast(StereoFrame& frame, const ImageSettings& settings) {
  if (!settings.clahe) return;
  const auto clahe = cv::createCLAHE(kClaheClipLimit, {kClaheTiles, kClaheTiles});
  for (cv::Mat* image : {&frame.left, &frame.right}) {
    cv::Mat result;
    clahe->apply(*image, result);
    *image = result;
  }
}

}  // namespace stereo_slam
