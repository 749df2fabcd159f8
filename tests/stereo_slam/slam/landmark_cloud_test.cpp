// SPDX-License-Identifier: MIT
#include "stereo_slam/slam/global_map.hpp"
#include "stereo_slam/support/random_map.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

TEST_CASE("Landmarks of a loaded map move with their keyframes", "[stereo_slam][landmarks]") {
  SavedMap map = test::map_of(3, 2);
  map.points = {{{1.0, -2.0, 3.5}, 200, 0, 5}, {{0.5, 1.0, 20.0}, 7, 2, 9}};
  LoadedLandmarks landmarks(map);
  CHECK((landmarks.points()[1].position_world - map.points[1].position_world).norm() < 1e-12);

  std::vector<Pose> poses;
  for (const auto& keyframe : map.keyframes) poses.push_back(keyframe.T_world_keyframe.pose);
  const Pose motion = test::car_motion(3.0);
  poses[2] = motion * poses[2];
  for (int repeated = 0; repeated < 2; ++repeated) {
    landmarks.correct(poses);
    CHECK((landmarks.points()[0].position_world - map.points[0].position_world).norm() < 1e-12);
    CHECK((landmarks.points()[1].position_world - motion * map.points[1].position_world).norm() < 1e-12);
    CHECK(landmarks.points()[1].landmark == 9);
  }
  poses.pop_back();
  CHECK_THROWS_AS(landmarks.correct(poses), std::invalid_argument);
}

TEST_CASE("Points of one landmark become one, those without an id stay", "[stereo_slam][landmarks]") {
  const std::vector<MapPoint> points = {{{0.0, 0.0, 1.0}, 10, 0, 4}, {{5.0, 0.0, 0.0}, 20, 1, 0},
                                        {{0.0, 0.0, 2.0}, 30, 1, 4}, {{5.0, 0.0, 0.0}, 40, 1, 0},
                                        {{0.0, 3.0, 3.0}, 50, 2, 4}, {{7.0, 0.0, 0.0}, 60, 2, 3}};
  MergedLandmarks landmarks;
  for (const auto& point : points) landmarks.add(point);
  const auto& merged = landmarks.points();
  REQUIRE(merged.size() == 4);
  CHECK((merged[0].position_world - Vector3<double>(0.0, 1.0, 2.0)).norm() < 1e-12);
  CHECK(merged[0].intensity == 10);
  CHECK(merged[0].keyframe == 0);
  CHECK(merged[1].intensity == 20);
  CHECK(merged[2].intensity == 40);
  CHECK(merged[3].landmark == 3);
  CHECK(MergedLandmarks().points().empty());
}

}  // namespace
}  // namespace stereo_slam
