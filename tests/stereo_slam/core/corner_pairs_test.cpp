// SPDX-License-Identifier: MIT
#include "stereo_slam/core/corner_pairs.hpp"

#include <cmath>
#include <random>
#include <vector>

#include "support/catch.hpp"

namespace stereo_slam {
namespace {

TEST_CASE("The line of the rows tells displacement and roll of the right image, beside wrong pairs",
          "[stereo_slam][features]") {
  constexpr double kOffset_px = -3.0, kSlope = 0.004, kNoise_px = 0.1;
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0.0, kNoise_px);
  std::uniform_real_distribution<double> column(0.0, 1200.0), wrong(-60.0, 60.0);
  std::vector<CornerPair> pairs;
  for (int i = 0; i < 200; ++i) {
    const double x = column(random), row = 180.0;
    const double differ = i % 4 == 0 ? wrong(random) : kOffset_px + kSlope * x + noise(random);
    pairs.push_back({{static_cast<float>(x + 10.0), static_cast<float>(row + differ)},
                     {static_cast<float>(x), static_cast<float>(row)}});
  }
  const RobustLine line = line_of_rows(pairs, kNoise_px);
  // 150 right pairs tell the line to .1 px / sqrt(150) in the middle.
  CHECK(std::abs(line.at(600.0) - kOffset_px - 600.0 * kSlope) < 5.0 * kNoise_px / std::sqrt(150.0));
  CHECK(std::abs(line.slope - kSlope) < 5.0 * kNoise_px / std::sqrt(150.0) / 300.0);
  CHECK(line.median_residual < 2.0 * kNoise_px);
}

TEST_CASE("Images without corners have no pairs, and no pairs no line", "[stereo_slam][features]") {
  const cv::Mat grey(100, 200, CV_8UC1, cv::Scalar(80));
  CHECK(match_corners(grey, grey).empty());
  CHECK(match_corners(grey, cv::Mat()).empty());
  const RobustLine line = line_of_rows({}, 0.1);
  CHECK((line.offset == 0.0 && line.slope == 0.0));
}

}  // namespace
}  // namespace stereo_slam
