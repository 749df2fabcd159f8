// SPDX-License-Identifier: MIT
#include "stereo_slam/loop_closing/keyframe_graph.hpp"

#include "stereo_slam/support/random_map.hpp"
#include "stereo_slam/support/scenes.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

constexpr double kSpacing_m = 2.0;
constexpr double kTolerance = 1e-12;  // rounding of a dozen products of poses

/// Keyframes on a straight road, with as many in each segment as given.
KeyframeGraph straight_road(const std::vector<std::size_t>& keyframes_per_segment) {
  KeyframeGraph graph(10, 0.0);
  for (std::size_t segment = 0; segment < keyframes_per_segment.size(); ++segment) {
    for (std::size_t i = 0; i < keyframes_per_segment[segment]; ++i) {
      Keyframe keyframe;
      keyframe.frame = 10 * graph.size();
      keyframe.segment = segment;
      if (graph.size() > 0) keyframe.T_previous_keyframe = test::estimate(kSpacing_m, 1e-4);
      graph.add(std::move(keyframe));
    }
  }
  return graph;
}

Pose relative(const KeyframeGraph& graph, std::size_t from, std::size_t to) {
  return graph[from].T_world_keyframe.pose.inverse() * graph[to].T_world_keyframe.pose;
}

TEST_CASE("A keyframe's pose and path length are composed from the keyframe before", "[stereo_slam][loops]") {
  const KeyframeGraph graph = straight_road({3});
  const Pose step = test::estimate(kSpacing_m, 1e-4).pose;
  CHECK(graph[2].id == 2);
  CHECK(graph[0].T_world_keyframe.pose.is_approx(Pose::identity(), kTolerance));
  CHECK(graph[2].T_world_keyframe.pose.is_approx(step * step, kTolerance));
  CHECK(graph[2].path_length_m == Approx(2.0 * step.translation().norm()));
  CHECK(graph[2].T_world_keyframe.covariance.trace() > graph[1].T_world_keyframe.covariance.trace());
}

TEST_CASE("Memory per keyframe is bounded, and reported", "[stereo_slam][loops]") {
  constexpr std::size_t kMaxPoints = 40;
  constexpr std::size_t kGrowth = 2;  // largest ratio of a vector's capacity to its size
  KeyframeGraph graph(kMaxPoints, 0.0);
  for (std::size_t i = 0; i < 100; ++i) {
    Keyframe keyframe;
    keyframe.frame = i;
    keyframe.points.resize(10 * kMaxPoints);
    graph.add(std::move(keyframe));
    CHECK(graph.keyframes().back().points.size() == kMaxPoints);
    const std::size_t of_points = kMaxPoints * sizeof(KeyframePoint);
    CHECK(graph.memory_bytes() <= graph.size() * (kGrowth * sizeof(Keyframe) + of_points));
    CHECK(graph.memory_bytes() >= graph.size() * of_points);
  }
}

TEST_CASE("A keyframe of an earlier or the same frame is refused", "[stereo_slam][loops][error]") {
  KeyframeGraph graph = straight_road({2});
  Keyframe same;
  same.frame = 10;
  CHECK_THROWS_WITH(graph.add(same), "keyframe of frame 10 follows one of frame 10: frames must increase");
  CHECK(graph.size() == 2);
}

TEST_CASE("The first loop between two segments moves the later one, and guesses after it",
          "[stereo_slam][loops]") {
  KeyframeGraph graph = straight_road({2, 2, 1});
  const Pose within = relative(graph, 2, 3);
  const Pose guessed = relative(graph, 3, 4);
  const PoseGaussian measured = test::estimate(0.3, 1e-4);
  CHECK_FALSE(graph.localised(graph[2]));
  SECTION("from the earlier segment to the later one") { graph.join_segments({0, 2, measured}); }
  SECTION("from the later segment to the earlier one") {
    graph.join_segments({2, 0, {measured.pose.inverse(), measured.covariance}});
  }
  CHECK(graph.localised(graph[2]));
  CHECK_FALSE(graph.localised(graph[4]));
  CHECK(graph[1].T_world_keyframe.pose.is_approx(test::estimate(kSpacing_m, 0.0).pose, kTolerance));
  CHECK(relative(graph, 0, 2).is_approx(measured.pose, kTolerance));
  CHECK(relative(graph, 2, 3).is_approx(within, kTolerance));
  CHECK(relative(graph, 3, 4).is_approx(guessed, kTolerance));
  const auto odometry = graph.pose_graph().odometry;
  CHECK(odometry[1].T_from_to.pose.is_approx(relative(graph, 1, 2), kTolerance));
  CHECK(odometry[1].T_from_to.covariance(5, 5) > 1e3);
  CHECK(odometry[3].T_from_to.covariance(5, 5) < 1.0);  // still a guess
  CHECK(odometry[0].measured);
  CHECK_FALSE(odometry[1].measured);
  CHECK_FALSE(odometry[3].measured);
}

TEST_CASE("A loop between joined segments does not move them", "[stereo_slam][loops]") {
  KeyframeGraph graph = straight_road({3});
  const Pose before = relative(graph, 0, 2);
  graph.join_segments({0, 2, test::estimate(0.3, 1e-4)});
  CHECK(relative(graph, 0, 2).coeffs() == before.coeffs());
}

TEST_CASE("The shortest path between keyframes may lead over one loop", "[stereo_slam][loops]") {
  KeyframeGraph graph = straight_road({21});
  const double step_m = graph[1].path_length_m;
  CHECK(graph.path_length_m(1, 20) == Approx(19.0 * step_m));
  graph.add_loop({2, 18, test::estimate(0.1, 1e-4)});
  CHECK(graph.path_length_m(1, 20) == Approx(3.0 * step_m));
  CHECK(graph.path_length_m(1, 3) == Approx(2.0 * step_m));
}

TEST_CASE("Without loops new odometry moves keyframes at once, with loops the optimisation does",
          "[stereo_slam][loops]") {
  KeyframeGraph graph = straight_road({4});
  const PoseGaussian longer = test::estimate(3.0, 1e-4);
  const Pose before = relative(graph, 1, 2);
  SECTION("without loops") {
    graph.replace({{2, longer}});
    CHECK(relative(graph, 1, 2).is_approx(longer.pose, kTolerance));
  }
  SECTION("with a loop") {
    graph.add_loop({0, 3, {relative(graph, 0, 1) * longer.pose * relative(graph, 2, 3), longer.covariance}});
    graph.replace({{2, longer}});
    CHECK(relative(graph, 1, 2).coeffs() == before.coeffs());
    CHECK(graph.optimize({}).size() == 4);
    CHECK(relative(graph, 1, 2).is_approx(longer.pose, 1e-6));  // where the solver stops
  }
  CHECK(relative(graph, 2, 3).is_approx(before, 1e-6));
}

TEST_CASE("A loaded map keeps its poses if the run is only localised in it", "[stereo_slam][loops]") {
  const SavedMap map = test::map_of(4, 5);
  KeyframeGraph graph(10, 0.0);
  graph.load(map, MapUse::kLocalise);
  CHECK(graph.pose_graph().gauge == 4);
  CHECK(graph.loops().size() == 1);
  for (std::size_t id = 0; id < 4; ++id) {
    CHECK(graph[id].T_world_keyframe.pose.coeffs() == map.keyframes[id].T_world_keyframe.pose.coeffs());
  }
  CHECK((graph.keyframes().back().T_world_keyframe.pose * graph.unknown_link().pose)
            .is_approx(Pose::identity(), kTolerance));
}

}  // namespace
}  // namespace stereo_slam
