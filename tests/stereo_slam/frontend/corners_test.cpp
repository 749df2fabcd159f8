// SPDX-License-Identifier: MIT
#include "stereo_slam/frontend/corners.hpp"

#include <algorithm>

#include <opencv2/imgproc.hpp>

#include "stereo_slam/frontend/features.hpp"
#include "stereo_slam/support/scenes.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

/// Bright squares on a dark ground, one every 40 px, a little out of focus as any lens makes them.
cv::Mat squares(int contrast) {
  cv::Mat image(200, 320, CV_8UC1, cv::Scalar(60));
  for (int y = 30; y < image.rows - 20; y += 40) {
    for (int x = 30; x < image.cols - 20; x += 40) {
      cv::rectangle(image, {x, y, 9, 9}, cv::Scalar(60 + contrast), cv::FILLED);
    }
  }
  cv::GaussianBlur(image, image, {0, 0}, 0.7);
  return image;
}

double distance_to_corner(const Vector2<double>& px) {
  double nearest = 1e9;
  for (int y = 30; y < 180; y += 40) {
    for (int x = 30; x < 300; x += 40) {
      for (const auto& corner : {Vector2<double>(x, y), Vector2<double>(x + 8, y), Vector2<double>(x, y + 8),
                                 Vector2<double>(x + 8, y + 8)}) {
        nearest = std::min(nearest, (px - corner).norm());
      }
    }
  }
  return nearest;
}

TEST_CASE("Corners are found where the image has them, as many a cell as wanted", "[stereo_slam][features]") {
  const cv::Mat image = squares(120);
  const auto corners = detect_corners(image, {}, {}, {.cell_px = 40, .per_cell = 2});
  REQUIRE(corners.size() >= 28);
  std::vector<int> by_cell(40);
  for (const auto& corner : corners) {
    CAPTURE(corner.position_px.transpose());
    CHECK(distance_to_corner(corner.position_px) <= 2.0);
    CHECK(corner.response > 0.0);
    const auto column = static_cast<std::size_t>(corner.position_px.x() / 40.0);
    const auto row = static_cast<std::size_t>(corner.position_px.y() / 40.0);
    ++by_cell[row * 8 + column];
  }
  CHECK(*std::max_element(by_cell.begin(), by_cell.end()) == 2);
}

TEST_CASE("Cells that are full are left alone, and corners keep their distance", "[stereo_slam][features]") {
  const cv::Mat image = squares(120);
  const CornerGrid grid{.cell_px = 40, .per_cell = 1};
  const auto all = positions(detect_corners(image, {}, {}, grid));
  CHECK(detect_corners(image, all, {}, grid).empty());
  for (const auto& corner : detect_corners(image, {}, all, grid)) {
    for (const auto& px : all) CHECK((corner.position_px - px).norm() > grid.min_distance_px);
  }
  // Points outside the image take no room.
  CHECK(detect_corners(image, {{-50.0, 10.0}, {1e6, 1e6}}, {}, grid).size() == all.size());
}

TEST_CASE("Corners of neighbouring cells keep their distance, too", "[stereo_slam][features]") {
  cv::Mat noise(200, 320, CV_8UC1);
  cv::RNG(5).fill(noise, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(noise, noise, {0, 0}, 1.0);
  const CornerGrid grid{.cell_px = 16, .per_cell = 5, .min_distance_px = 6.0};
  const auto corners = positions(detect_corners(noise, {}, {}, grid));
  REQUIRE(corners.size() > 100);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) CHECK((corners[i] - corners[k]).norm() >= grid.min_distance_px);
  }
}

TEST_CASE("Weak corners are taken where there are too few strong ones", "[stereo_slam][features]") {
  const cv::Mat dim = squares(30);
  CHECK(detect_corners(dim, {}, {}, {.cell_px = 40, .per_cell = 2}).empty());
  CHECK(detect_corners(dim, {}, {}, {.cell_px = 40, .per_cell = 2, .enough = 10}).size() >= 10);
}

TEST_CASE("Images without corners, tiny ones and none at all give no corners", "[stereo_slam][features]") {
  CHECK(detect_corners(cv::Mat(), {}, {}, {}).empty());
  CHECK(detect_corners(cv::Mat(200, 320, CV_8UC1, cv::Scalar(80)), {}, {}, {.enough = 10}).empty());
  for (const int side : {1, 7, 37, 40}) {
    const cv::Mat tiny = test::texture_image({side, side}, {0.0, 0.0});
    for (const auto& corner : detect_corners(tiny, {}, {}, {.enough = 10})) {
      CHECK(corner.position_px.minCoeff() >= kDescriptorReach_px);
      CHECK(corner.position_px.maxCoeff() < side - kDescriptorReach_px);
    }
  }
}

}  // namespace
}  // namespace stereo_slam
