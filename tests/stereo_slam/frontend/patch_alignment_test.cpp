// SPDX-License-Identifier: MIT
#include "stereo_slam/frontend/patch_alignment.hpp"

#include <cmath>
#include <limits>
#include <random>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "stereo_slam/frontend/stereo_matching.hpp"
#include "stereo_slam/support/scenes.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

const cv::Size kSize(200, 120);

TEST_CASE("A patch is found to a thirtieth of a pixel, whatever the gain and offset",
          "[stereo_slam][images]") {
  const cv::Mat source = test::texture_image(kSize, {0.0, 0.0});
  for (const auto& shift : {cv::Point2d(0.0, 0.0), cv::Point2d(0.37, -0.61), cv::Point2d(-0.9, 0.3)}) {
    const cv::Mat target = test::texture_image(kSize, shift, 0.7, 20.0);
    double sum2 = 0.0;
    int found_patches = 0;
    for (double y = 20.7; y < 100.0; y += 12.6) {
      for (double x = 20.3; x < 180.0; x += 14.2) {
        const Eigen::Vector2d centre(x, y);
        const auto patch = PatchTemplate::extract(source, centre);
        const auto found = patch ? patch->align(target, centre) : std::nullopt;
        if (!found) continue;  // the periods of the texture have weak spots
        const double error = (found->position_px - centre - Eigen::Vector2d(shift.x, shift.y)).norm();
        CHECK(error < 0.1);
        CHECK(found->correlation > 0.98);
        sum2 += error * error;
        ++found_patches;
      }
    }
    REQUIRE(found_patches > 60);
    CHECK(std::sqrt(sum2 / found_patches) < 0.033);
  }
}

TEST_CASE("A warped patch is found in a magnified image", "[stereo_slam][images]") {
  constexpr double kMagnification = 1.15;
  const cv::Mat source = test::texture_image(kSize, {0.0, 0.0});
  cv::Mat target(kSize, CV_8UC1);
  for (int y = 0; y < kSize.height; ++y) {
    for (int x = 0; x < kSize.width; ++x) {
      target.at<std::uint8_t>(y, x) =
          cv::saturate_cast<std::uint8_t>(test::smooth_texture(x / kMagnification, y / kMagnification));
    }
  }
  const Eigen::Vector2d centre(121.4, 63.7);
  const auto patch = PatchTemplate::extract(source, centre, {Eigen::Matrix2d::Identity() / kMagnification});
  REQUIRE(patch);
  const auto found = patch->align(target, kMagnification * centre + Eigen::Vector2d(0.8, -0.5));
  REQUIRE(found);
  CHECK((found->position_px - kMagnification * centre).norm() < 0.03);
}

TEST_CASE("The covariance of an aligned patch follows its errors", "[stereo_slam][images]") {
  constexpr double kNoise = 6.0;  // grey levels
  const cv::Mat source = test::texture_image(kSize, {0.0, 0.0}, 0.7, 30.0);
  std::mt19937_64 random(5);
  std::normal_distribution<double> noise(0.0, kNoise);
  double nees = 0.0;
  int count = 0;
  for (int repetition = 0; repetition < 8; ++repetition) {
    cv::Mat target = source.clone();
    for (int y = 0; y < kSize.height; ++y) {
      for (int x = 0; x < kSize.width; ++x) {
        auto& value = target.at<std::uint8_t>(y, x);
        value = cv::saturate_cast<std::uint8_t>(value + noise(random));
      }
    }
    for (double y = 20.0; y < 100.0; y += 13.0) {
      for (double x = 20.0; x < 180.0; x += 14.0) {
        const auto patch = PatchTemplate::extract(source, {x, y});
        const auto found = patch ? patch->align(target, {x, y}) : std::nullopt;
        if (!found) continue;
        const Eigen::Vector2d error = found->position_px - Eigen::Vector2d(x, y);
        nees += error.dot(found->covariance_px2.inverse() * error);
        ++count;
      }
    }
  }
  REQUIRE(count > 400);
  // Two terms. Interpolation smooths the noise in what is left, so that the covariance is a little too small.
  CHECK(nees / count > 2.0);
  CHECK(nees / count < 4.0);
}

TEST_CASE("A patch whose edges have one direction is less certain along them", "[stereo_slam][images]") {
  cv::Mat image(kSize, CV_8UC1);
  for (int y = 0; y < kSize.height; ++y) {
    for (int x = 0; x < kSize.width; ++x) {
      image.at<std::uint8_t>(y, x) =
          cv::saturate_cast<std::uint8_t>(120.0 + 70.0 * std::sin(0.9 * x) + 15.0 * std::sin(0.8 * y));
    }
  }
  const auto patch = PatchTemplate::extract(image, {100.0, 60.0});
  REQUIRE(patch);
  const auto found = patch->align(image, {100.3, 59.8});
  REQUIRE(found);
  CHECK(found->covariance_px2(1, 1) > 5.0 * found->covariance_px2(0, 0));

  const auto both = stereo_patch_covariance(found->covariance_px2, found->covariance_px2);
  CHECK(both.isApprox(both.transpose()));
  CHECK(Eigen::LLT<Eigen::Matrix3d>(both).info() == Eigen::Success);
  CHECK(both(1, 1) > 5.0 * both(0, 0));
}

TEST_CASE("Dark and dull images need less texture", "[stereo_slam][images]") {
  cv::Mat chessboard = test::chessboard(kSize, 8, 0.0);
  CHECK(min_texture(chessboard) == PatchTemplate::kTexture);
  cv::Mat dark, black;
  chessboard.convertTo(dark, -1, 0.25);
  chessboard.convertTo(black, -1, 0.01);
  CHECK(min_texture(dark) < 0.3 * PatchTemplate::kTexture);
  CHECK(min_texture(black) > 0.1 * PatchTemplate::kTexture);  // noise has some, too
  CHECK(min_texture(black) < min_texture(dark));
  CHECK(min_texture(cv::Mat()) == PatchTemplate::kTexture);
}

TEST_CASE("Patches without texture, across the border, or outside the image are refused",
          "[stereo_slam][images]") {
  const cv::Mat source = test::texture_image(kSize, {0.0, 0.0});
  const cv::Mat flat(kSize, CV_8UC1, cv::Scalar(90));
  cv::Mat edge = flat.clone();
  edge.rowRange(60, 120).setTo(160);  // an edge has no position along itself
  CHECK_FALSE(PatchTemplate::extract(flat, {60.0, 60.0}));
  CHECK_FALSE(PatchTemplate::extract(edge, {60.0, 60.0}));
  CHECK_FALSE(PatchTemplate::extract(source, {3.0, 60.0}));
  CHECK_FALSE(PatchTemplate::extract(source, {60.0, 119.0}));
  CHECK_FALSE(PatchTemplate::extract(source, {std::numeric_limits<double>::quiet_NaN(), 60.0}));
  const auto patch = PatchTemplate::extract(source, {60.0, 60.0});
  REQUIRE(patch);
  CHECK_FALSE(patch->align(flat, {60.0, 60.0}));
  CHECK_FALSE(patch->align(source, {-40.0, 60.0}));
  CHECK_FALSE(patch->align(source, {199.0, 60.0}));
}

TEST_CASE("Disparities are found to a fraction of a pixel, also where the right image sits lower",
          "[stereo_slam][images]") {
  constexpr double kDisparity_px = 17.3;
  constexpr double kRowOffset_px = 1.4;
  const StereoCamera camera{200.0, 200.0, 100.0, 60.0, 0.5, kSize.width, kSize.height};
  PairGeometry::Coefficients offset = PairGeometry::Coefficients::Zero();
  offset(1, 0) = kRowOffset_px;
  const PairGeometry rectification(camera, offset);
  const cv::Mat left = test::texture_image(kSize, {0.0, 0.0});
  const cv::Mat right = test::texture_image(kSize, {-kDisparity_px, kRowOffset_px});
  const std::vector<Vector2<double>> points = {{100.0, 60.0}, {150.2, 40.8}, {4.0, 60.0}, {80.0, 118.0}};
  StereoMatchingSettings settings;
  settings.uniqueness = 1.0;  // the texture is periodic enough to have rivals
  settings.max_disparity_px = 30;
  const auto matches = match_stereo({{0, 0, left, right}, camera, rectification}, points, settings);
  REQUIRE(matches.size() == points.size());
  for (const std::size_t i : {0U, 1U}) {
    REQUIRE(matches[i]);
    CHECK(std::abs(matches[i]->z.z() - kDisparity_px) < 0.05);
    CHECK(std::abs(matches[i]->row_error_px) < 0.03);
    CHECK(matches[i]->z.head<2>() == points[i]);
  }
  CHECK_FALSE(matches[2]);  // too near the borders
  CHECK_FALSE(matches[3]);
}

}  // namespace
}  // namespace stereo_slam
