// SPDX-License-Identifier: MIT
#include "stereo_slam/local_map/reobserved_landmarks.hpp"

#include "stereo_slam/support/scenes.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

Match match_at(std::size_t landmark, double u, double v) {
  Match match;
  match.landmark = landmark;
  match.z = {u, v, 20.0};
  match.left_px = {u, v};
  return match;
}

TEST_CASE("A re-observed landmark continues in the nearest point, and in one only",
          "[stereo_slam][landmarks]") {
  std::vector<Landmark> landmarks(3);
  for (std::uint32_t i = 0; i < 3; ++i) landmarks[i].id = 40 + i;
  const ReobservedLandmarks reobserved({match_at(2, 100.0, 50.0), match_at(0, 200.0, 50.0)}, landmarks);
  const auto ids = reobserved.ids_at(
      test::points_at({{100.4, 50.3, 20.0}, {100.9, 50.0, 20.0}, {150.0, 50.0, 20.0}, {200.0, 51.0, 9.0}}),
      {320, 100});
  REQUIRE(ids.size() == 4);
  CHECK(ids[0] == std::optional<std::uint32_t>(42));
  CHECK_FALSE(ids[1].has_value());
  CHECK_FALSE(ids[2].has_value());
  CHECK(ids[3] == std::optional<std::uint32_t>(40));
  CHECK(ReobservedLandmarks().ids_at(test::points_at({{1.0, 1.0, 1.0}}), {320, 100}).size() == 1);
}

}  // namespace
}  // namespace stereo_slam
