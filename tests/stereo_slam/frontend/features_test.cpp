// SPDX-License-Identifier: MIT
#include "stereo_slam/frontend/features.hpp"

#include "stereo_slam/frontend/spatial_index.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

const cv::Size kImage(1241, 376);

TEST_CASE("Features near used positions are excluded", "[stereo_slam][features]") {
  std::vector<Feature> features(3);
  features[0].position_px = {10.0, 10.0};
  features[1].position_px = {13.0, 10.0};
  features[2].position_px = {50.0, 50.0};
  const auto kept = exclude_features(features, {{11.0, 10.0}, {-5.0, 900.0}}, kImage, 1.5);
  REQUIRE(kept.size() == 2);
  CHECK(kept[0].position_px.x() == 13.0);
  CHECK(exclude_features({}, {}, kImage, 3.0).empty());
}

TEST_CASE("Buckets are served in turn, the last round evenly", "[stereo_slam][features]") {
  std::vector<Vector2<double>> points;
  for (int column = 0; column < 10; ++column) {
    for (int k = 0; k < 4; ++k) points.emplace_back(50.0 * column + 10.0 + k, 20.0);
  }
  const auto chosen = spread_over_buckets(points, {500, 40}, 50, 15);
  REQUIRE(chosen.size() == 15);
  for (std::size_t i = 0; i < 10; ++i) CHECK(chosen[i] == 4 * i);  // the first of each
  CHECK(chosen[14] >= 32);                                         // the second round reaches the far end
  CHECK(spread_over_buckets(points, {500, 40}, 50, 1000).size() == points.size());
  CHECK(spread_over_buckets({}, {500, 40}, 50, 10).empty());
}

TEST_CASE("Points within a radius are found across cells and at the border", "[stereo_slam][features]") {
  const SpatialIndex index({{15.5, 15.5}, {16.5, 16.5}, {1240.0, 375.0}}, kImage);
  CHECK(index.any_within({17.0, 17.0}, 1.0));
  CHECK(index.any_within({14.5, 15.5}, 1.0));
  CHECK_FALSE(index.any_within({30.0, 30.0}, 5.0));
  CHECK(index.any_within({1245.0, 380.0}, 10.0));
  CHECK_FALSE(index.any_within({-100.0, -100.0}, 10.0));
}

TEST_CASE("Points of a cell are visited in their order", "[stereo_slam][features]") {
  const SpatialIndex index({{3.0, 3.0}, {40.0, 3.0}, {5.0, 3.0}, {-1.0, 3.0}, {4.0, 3.0}}, kImage);
  std::vector<std::size_t> visited;
  index.for_each_in_box({20.0, 3.0}, {25.0, 5.0}, [&](std::size_t i) { visited.push_back(i); });
  CHECK(visited == std::vector<std::size_t>{0, 2, 4, 1});
}

TEST_CASE("Spread features are the strongest of every bucket first", "[stereo_slam][features]") {
  std::vector<Feature> features(4);
  for (std::size_t i = 0; i < features.size(); ++i) {
    features[i].position_px = {i < 3 ? 10.0 : 110.0, 20.0};
    features[i].response = static_cast<double>(i);
  }
  const auto spread = spread_features(features, {200, 40}, 50, 3);
  REQUIRE(spread.size() == 3);
  CHECK(spread[0].response == 2.0);
  CHECK(spread[1].response == 3.0);
  CHECK(spread[2].response == 1.0);
}

}  // namespace
}  // namespace stereo_slam
