// SPDX-License-Identifier: MIT
#include "stereo_slam/keyframes/keyframe_database.hpp"

#include "stereo_slam/core/pose_estimate.hpp"
#include "stereo_slam/support/scenes.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

constexpr std::size_t kMaxPoints = 40;

Keyframe keyframe_of(std::size_t frame, std::size_t points) {
  Keyframe keyframe;
  keyframe.frame = frame;
  keyframe.points.resize(points);
  keyframe.T_previous_keyframe = {test::car_motion(), 1e-4 * Matrix6<double>::Identity()};
  return keyframe;
}

KeyframeDatabase database_of(std::size_t keyframes) {
  KeyframeDatabase database(kMaxPoints);
  for (std::size_t i = 0; i < keyframes; ++i) database.add(keyframe_of(10 * i, 30));
  return database;
}

TEST_CASE("A keyframe's pose and path length are composed from the keyframe before",
          "[stereo_slam][keyframes]") {
  const auto database = database_of(3);
  CHECK(database[2].id == 2);
  CHECK(database[0].T_world_keyframe.pose.is_approx(Pose::identity(), 1e-15));
  CHECK(database[2].T_world_keyframe.pose.is_approx(test::car_motion() * test::car_motion(), 1e-14));
  CHECK(database[2].path_length_m == Approx(2.0 * test::car_motion().translation().norm()));
  CHECK(database[2].T_world_keyframe.covariance.trace() > database[1].T_world_keyframe.covariance.trace());
}

TEST_CASE("Memory per keyframe is bounded, and reported", "[stereo_slam][keyframes]") {
  KeyframeDatabase database(kMaxPoints);
  for (std::size_t i = 0; i < 100; ++i) {
    database.add(keyframe_of(i, 10 * kMaxPoints));
    CHECK(database.back().points.size() == kMaxPoints);
    CHECK(database.memory_bytes() <= database.size() * database.max_bytes_per_keyframe());
    CHECK(database.memory_bytes() >= database.size() * kMaxPoints * sizeof(KeyframePoint));
  }
}

TEST_CASE("Later keyframes keep their relative poses when the first are corrected",
          "[stereo_slam][keyframes]") {
  auto database = database_of(4);
  const Pose relative = database[1].T_world_keyframe.pose.inverse() * database[3].T_world_keyframe.pose;
  const Pose moved = database[1].T_world_keyframe.pose.boxplus(Vector6<double>::Constant(0.1));
  database.correct({{}, {moved, Matrix6<double>::Zero()}});
  CHECK(database[1].T_world_keyframe.pose.is_approx(moved, 1e-15));
  CHECK((database[1].T_world_keyframe.pose.inverse() * database[3].T_world_keyframe.pose)
            .is_approx(relative, 1e-13));
  CHECK_THROWS_AS(database.correct(std::vector<PoseGaussian>(5)), std::invalid_argument);
}

TEST_CASE("A keyframe of an earlier or the same frame is refused", "[stereo_slam][keyframes][error]") {
  auto database = database_of(2);
  CHECK_THROWS_WITH(database.add(keyframe_of(10, 1)),
                    "keyframe of frame 10 follows one of frame 10: frames must increase");
}

TEST_CASE("Points of a keyframe without landmarks have the landmark id 0", "[stereo_slam][keyframes]") {
  const StereoPoints points = test::points_at({{10.0, 20.0, 3.0}, {11.0, 21.0, 4.0}});
  CHECK(keyframe_points(points, {})[1].landmark == 0);
  CHECK(keyframe_points(points, {7, 9})[1].landmark == 9);
  CHECK(measurement(keyframe_points(points, {})[1]) == StereoPoint(11.0, 21.0, 4.0));
}

}  // namespace
}  // namespace stereo_slam
