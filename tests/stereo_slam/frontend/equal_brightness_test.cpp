// SPDX-License-Identifier: MIT
#include "stereo_slam/frontend/equal_brightness.hpp"

#include <utility>

#include <opencv2/core.hpp>

#include "support/catch.hpp"

namespace stereo_slam {
namespace {

/// A pair of the same image, the right one with another gain and offset.
StereoFrame pair_with(double gain, double offset) {
  StereoFrame frame;
  frame.left = cv::Mat(480, 640, CV_8UC1);
  cv::RNG(3).fill(frame.left, cv::RNG::UNIFORM, 60, 140);
  frame.left.convertTo(frame.right, -1, gain, offset);
  return frame;
}

TEST_CASE("A right image with another exposure gets the brightness of the left one",
          "[stereo_slam][features]") {
  for (const auto& [gain, offset] : {std::pair{1.6, 0.0}, {0.5, 0.0}, {1.0, 60.0}, {0.8, -10.0}}) {
    CAPTURE(gain, offset);
    const StereoFrame frame = pair_with(gain, offset);
    const StereoFrame equal = with_equal_brightness(frame);
    CHECK(equal.left.data == frame.left.data);
    CHECK(cv::norm(frame.left, frame.right, cv::NORM_L1) > 5.0 * frame.left.total());
    CHECK(cv::norm(frame.left, equal.right, cv::NORM_L1) < 1.0 * frame.left.total());
  }
}

TEST_CASE("Images of similar brightness are not copied, nor are black or plain ones",
          "[stereo_slam][features]") {
  for (const double gain : {0.95, 1.0, 1.1}) {
    const StereoFrame frame = pair_with(gain, 0.0);
    CHECK(with_equal_brightness(frame).right.data == frame.right.data);
  }
  StereoFrame frame = pair_with(1.0, 0.0);
  for (const int grey : {0, 3, 120, 255}) {
    frame.right = cv::Mat(480, 640, CV_8UC1, cv::Scalar(grey));
    CHECK(with_equal_brightness(frame).right.data == frame.right.data);
  }
  for (const cv::Size size : {cv::Size(1, 1), cv::Size(7, 7), cv::Size(9, 100), cv::Size()}) {
    frame.left = cv::Mat(size, CV_8UC1, cv::Scalar(10));
    frame.right = cv::Mat(size, CV_8UC1, cv::Scalar(200));
    CHECK(with_equal_brightness(frame).right.data == frame.right.data);
  }
}

TEST_CASE("What only one camera sees does not change the brightness", "[stereo_slam][features]") {
  for (const int grey : {0, 255}) {
    StereoFrame frame = pair_with(1.0, 0.0);
    frame.right = frame.right.clone();
    frame.right.colRange(400, 640).setTo(grey);
    CHECK(with_equal_brightness(frame).right.data == frame.right.data);
  }
  StereoFrame frame = pair_with(1.6, 0.0);
  frame.right.colRange(450, 640).setTo(255);
  const StereoFrame equal = with_equal_brightness(frame);
  CHECK(cv::norm(frame.left.colRange(0, 450), equal.right.colRange(0, 450), cv::NORM_INF) <= 2.0);
}

TEST_CASE("Parts of a larger image are adapted as whole images are", "[stereo_slam][features]") {
  const StereoFrame whole = pair_with(0.6, 0.0);
  cv::Mat both;
  cv::hconcat(whole.left, whole.right, both);
  StereoFrame halves;
  halves.left = both.colRange(0, 640);
  halves.right = both.colRange(640, 1280);
  const cv::Mat adapted = with_equal_brightness(halves).right;
  CHECK(cv::norm(adapted, with_equal_brightness(whole).right, cv::NORM_INF) == 0.0);
  CHECK(cv::norm(both.colRange(640, 1280), whole.right, cv::NORM_INF) == 0.0);
}

}  // namespace
}  // namespace stereo_slam
