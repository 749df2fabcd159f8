// SPDX-License-Identifier: MIT
#include "stereo_slam/frontend/slanted_match.hpp"

#include <cmath>
#include <limits>
#include <vector>

#include "stereo_slam/support/scenes.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

const cv::Size kImageSize(200, 120);
const Eigen::Vector2d kCentre(110.0, 60.0);
constexpr double kDisparity_px = 21.3;

/// The right image of a surface with this slope of the disparity, which is kDisparity_px at kCentre.
cv::Mat right_image(const Eigen::Vector2d& slope, double gain = 1.0) {
  cv::Mat right(kImageSize, CV_8UC1);
  for (int y = 0; y < kImageSize.height; ++y) {
    for (int x = 0; x < kImageSize.width; ++x) {
      // x = u - d(u, y), for u
      const double u =
          (x + kDisparity_px - slope.x() * kCentre.x() + slope.y() * (y - kCentre.y())) / (1.0 - slope.x());
      right.at<std::uint8_t>(y, x) = cv::saturate_cast<std::uint8_t>(gain * test::smooth_texture(u, y));
    }
  }
  return right;
}

TEST_CASE("The slope of a disparity is found, and the disparity is as accurate as on a level surface",
          "[stereo_slam][images]") {
  const cv::Mat left = test::texture_image(kImageSize, {0.0, 0.0});
  for (const auto& slope : {Eigen::Vector2d(0.0, 0.0), Eigen::Vector2d(0.0, 0.33), Eigen::Vector2d(0.1, 0.1),
                            Eigen::Vector2d(-0.08, 0.2)}) {
    const cv::Mat right = right_image(slope, GENERATE(1.0, 0.8));
    double disparity_error2 = 0.0;
    double slope_error2 = 0.0;
    int count = 0;
    for (double x = 80.3; x < 150.0; x += 9.7) {
      for (double y = 30.6; y < 95.0; y += 8.9) {
        const Eigen::Vector2d centre(x, y);
        const double disparity_px = kDisparity_px + slope.dot(centre - kCentre);
        const Eigen::Vector2d start = centre - Eigen::Vector2d(disparity_px + 0.3, -0.2);
        const SlantedMatch match = refine_slanted(left, centre, right, start);
        disparity_error2 += std::pow(x - match.right_px.x() - disparity_px, 2);
        slope_error2 += (match.disparity_slope - slope).squaredNorm();
        ++count;
      }
    }
    CAPTURE(slope.transpose());
    CHECK(std::sqrt(disparity_error2 / count) < 0.04);
    CHECK(std::sqrt(slope_error2 / count) < 0.03);
  }
}

TEST_CASE("Likely slopes are preferred to others where the texture allows it", "[stereo_slam][images]") {
  const cv::Mat left = test::texture_image(kImageSize, {0.0, 0.0});
  const Eigen::Vector2d road(0.0, 0.33);
  const Eigen::Vector2d start = kCentre - Eigen::Vector2d(kDisparity_px, 0.0);
  const auto error_with = [&](const Eigen::Vector2d& slope, const std::vector<Eigen::Vector2d>& likely) {
    return (refine_slanted(left, kCentre, right_image(slope), start, likely).disparity_slope - slope).norm();
  };
  CHECK(error_with(road, {{0.0, 0.0}, road}) < error_with(road, {}));
  CHECK(error_with(road, {{0.0, 0.0}, road}) < 0.01);
  // None of them: as without.
  const Eigen::Vector2d other(-0.15, 0.15);
  CHECK(error_with(other, {{0.0, 0.0}, road}) == error_with(other, {}));
}

TEST_CASE("A match that cannot be refined stays as it was", "[stereo_slam][images]") {
  const cv::Mat left = test::texture_image(kImageSize, {0.0, 0.0});
  const cv::Mat right = right_image({0.0, 0.3});
  const cv::Mat flat(kImageSize, CV_8UC1, cv::Scalar(90));
  const Eigen::Vector2d start = kCentre - Eigen::Vector2d(kDisparity_px, 0.0);
  const auto unchanged = [&](const cv::Mat& a, const Eigen::Vector2d& left_px, const cv::Mat& b,
                             const Eigen::Vector2d& right_px) {
    const SlantedMatch match = refine_slanted(a, left_px, b, right_px);
    return match.right_px == right_px && match.disparity_slope == Eigen::Vector2d::Zero();
  };
  CHECK(unchanged(flat, kCentre, right, start));
  CHECK(unchanged(left, kCentre, flat, start));
  CHECK(unchanged(left, {2.0, 60.0}, right, start));
  CHECK(unchanged(left, kCentre, right, {1.0, 60.0}));
  CHECK(unchanged(left, kCentre, right, kCentre + Eigen::Vector2d(60.0, 30.0)));
  CHECK(unchanged(left, {std::numeric_limits<double>::quiet_NaN(), 60.0}, right, start));
}

}  // namespace
}  // namespace stereo_slam
