// SPDX-License-Identifier: MIT
#include "stereo_slam/slam/global_map.hpp"

#include "stereo_slam/support/random_map.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

/// A run that archives landmarks under one keyframe after the other.
struct Run {
  StereoCamera camera = test::kitti_camera();
  LocalMap local_map{camera, MapSettings{}};
  KeyframeTrajectory trajectory;
  std::mt19937_64 random{5};

  Run() {
    trajectory.append({}, true);
    observe(20);
  }

  /// Adds landmarks to the reference keyframe, each observed often enough to be kept.
  void observe(std::size_t count) {
    const StereoFrame frame{0, 0, cv::Mat::zeros(camera.height_px, camera.width_px, CV_8UC1), {}};
    StereoPoints points;
    points.descriptors.resize(count);
    std::vector<std::uint32_t> ids;
    std::vector<Match> matches(count);
    for (std::size_t i = 0; i < count; ++i) {
      matches[i].landmark = i;
      matches[i].z = test::random_measurement(random, camera, 5.0, 20.0);
      matches[i].left_px = matches[i].z.head<2>();
      points.measured.push_back({matches[i].z, matches[i].left_px});
      ids.push_back(local_map.new_id());
    }
    local_map.add(points, ids, {}, frame);
    for (std::size_t again = 1; again < 4; ++again) local_map.record_observations(matches, {}, again);
  }

  void next_keyframe() {
    const PoseGaussian motion{test::car_motion(2.0), 1e-4 * Matrix6<double>::Identity()};
    trajectory.append(motion, true);
    trajectory.add_keyframe(trajectory.frames() - 1, {motion});
    local_map.restart(trajectory.reference());
    observe(10);
  }
};

void check_equal(const std::vector<MapPoint>& a, const std::vector<MapPoint>& b) {
  REQUIRE(a.size() == b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    CAPTURE(i);
    CHECK(a[i].position_world == b[i].position_world);
    CHECK(a[i].keyframe == b[i].keyframe);
    CHECK(a[i].landmark == b[i].landmark);
  }
}

TEST_CASE("Landmarks are archived with their keyframe, and the local map's come on top",
          "[stereo_slam][slam]") {
  Run run;
  GlobalMap map;
  CHECK(map.archived(run.local_map, run.trajectory, false).empty());
  CHECK(map.all(run.local_map, run.trajectory, false).size() == 20);
  run.next_keyframe();
  CHECK(map.archived(run.local_map, run.trajectory, false).size() == 20);
  CHECK(map.all(run.local_map, run.trajectory, false).size() == 30);
}

TEST_CASE("Points added one keyframe at a time are those computed at once", "[stereo_slam][slam]") {
  Run run;
  GlobalMap kept;
  for (int i = 0; i < 4; ++i) {
    run.next_keyframe();
    GlobalMap fresh;
    check_equal(kept.archived(run.local_map, run.trajectory, false),
                fresh.archived(run.local_map, run.trajectory, false));
  }
}

TEST_CASE("A correction moves the landmarks and merges those that loops have united", "[stereo_slam][slam]") {
  Run run;
  run.next_keyframe();
  run.next_keyframe();
  GlobalMap map;
  const auto before = map.archived(run.local_map, run.trajectory, false);
  REQUIRE(before.size() == 30);

  LoopCorrection correction;
  const Pose motion = test::car_motion(0.7);
  correction.T_world_keyframe = {{{motion, Matrix6<double>::Identity()}}};
  correction.identity.unite(before[0].landmark, before[25].landmark);
  run.trajectory.correct(correction.T_world_keyframe);
  map.correct(correction);

  const auto& after = map.archived(run.local_map, run.trajectory, false);
  REQUIRE(after.size() == 29);
  CHECK((after[1].position_world - motion * before[1].position_world).norm() < 1e-9);
  const Vector3<double> mean = 0.5 * (before[0].position_world + before[25].position_world);
  CHECK((after[0].position_world - motion * mean).norm() < 1e-9);
}

TEST_CASE("Landmarks of a loaded map come first, and ids of the run after its ids", "[stereo_slam][slam]") {
  Run run;
  run.next_keyframe();
  const SavedMap loaded = test::map_of(3, 2);
  GlobalMap map(loaded);
  CHECK(map.archived(run.local_map, run.trajectory, false).size() == 20);
  const auto& points = map.archived(run.local_map, run.trajectory, true);
  REQUIRE(points.size() == 20 + loaded.points.size());
  CHECK(points[0].landmark == loaded.points[0].landmark);
  const auto ids = MapIds::after(loaded);
  for (std::size_t i = loaded.points.size(); i < points.size(); ++i) {
    CHECK(points[i].landmark > ids.landmarks);
    CHECK(points[i].keyframe >= ids.keyframes);
  }
}

}  // namespace
}  // namespace stereo_slam
