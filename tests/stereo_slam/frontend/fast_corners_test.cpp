// SPDX-License-Identifier: MIT
#include "stereo_slam/frontend/fast_corners.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <opencv2/imgproc.hpp>

#include "support/catch.hpp"

namespace stereo_slam {
namespace {

cv::Mat noise_image() {
  cv::Mat noise(200, 320, CV_8UC1);
  cv::RNG(5).fill(noise, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(noise, noise, {0, 0}, 1.0);
  return noise;
}

TEST_CASE("A part of an image has the FAST corners that the whole image has there",
          "[stereo_slam][features]") {
  const cv::Mat image = noise_image();
  const cv::Rect part = cv::Rect(70, 40, 90, 55) & corner_area(image.size());
  const auto whole = fast_corners(image, corner_area(image.size()), 20);
  const auto in_part = fast_corners(image, part, 20);
  REQUIRE(in_part.size() > 10);
  auto expected = whole;
  std::erase_if(expected, [&](const cv::KeyPoint& k) { return !part.contains(cv::Point(k.pt)); });
  CHECK(std::ranges::equal(in_part, expected, {}, &cv::KeyPoint::pt, &cv::KeyPoint::pt));
  CHECK(std::is_sorted(whole.begin(), whole.end(), [](auto& a, auto& b) { return a.pt.y < b.pt.y; }));
}

TEST_CASE("The structure tensor is that of central differences", "[stereo_slam][features]") {
  const cv::Mat image = noise_image();
  for (const cv::Point centre : {cv::Point(20, 20), cv::Point(100, 57), cv::Point(314, 194)}) {
    double xx = 0.0, xy = 0.0, yy = 0.0;
    for (int y = centre.y - 3; y <= centre.y + 3; ++y) {
      for (int x = centre.x - 3; x <= centre.x + 3; ++x) {
        const double dx = 0.5 * (image.at<std::uint8_t>(y, x + 1) - image.at<std::uint8_t>(y, x - 1));
        const double dy = 0.5 * (image.at<std::uint8_t>(y + 1, x) - image.at<std::uint8_t>(y - 1, x));
        xx += dx * dx;
        xy += dx * dy;
        yy += dy * dy;
      }
    }
    const double smaller = 0.5 * (xx + yy - std::hypot(xx - yy, 2.0 * xy));
    CHECK(smallest_eigenvalue(image, centre) == Approx(smaller));
  }
}

TEST_CASE("A slope has no strength as a corner, and a small image no place for one",
          "[stereo_slam][features]") {
  cv::Mat slope(40, 40, CV_8UC1);
  for (int x = 0; x < slope.cols; ++x) slope.col(x).setTo(5 * x);
  CHECK(smallest_eigenvalue(slope, {20, 20}) == 0.0);
  CHECK(corner_area({38, 200}).empty());
}

}  // namespace
}  // namespace stereo_slam
