// SPDX-License-Identifier: MIT
#include "stereo_slam/tracking/pose_by_flow.hpp"

#include <cstddef>
#include <random>
#include <vector>

#include "stereo_slam/support/matched_scene.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

/// Landmarks whose flow ends where they are seen; the first `wrong` of them end elsewhere.
struct FlowScene {
  test::MatchedScene scene;
  std::vector<PredictedLandmark> predicted;
  std::vector<std::optional<LandmarkFlow>> flow;

  FlowScene(std::mt19937_64& random, const Pose& truth, int count, int wrong)
      : scene(test::make_scene(random, truth, count, 0.03, 0.3)) {
    std::uniform_real_distribution<double> far(20.0, 80.0);
    for (const auto& match : scene.matches) {
      predicted.push_back(match.predicted);
      predicted.back().index = match.landmark;
      Vector2<double> to_px = match.left_px;
      if (static_cast<int>(flow.size()) < wrong) to_px += Vector2<double>(far(random), -far(random));
      flow.push_back(LandmarkFlow{match.predicted.z.head<2>(), to_px});
    }
  }
};

TEST_CASE("The pose that most landmarks agree with is found by their flow, although others moved",
          "[stereo_slam][associate]") {
  std::mt19937_64 random(1);
  const Pose truth = test::car_motion(1.5);
  const FlowScene seen(random, truth, 100, 40);
  const auto found = pose_by_flow(seen.predicted, seen.flow, seen.scene.map(), {});
  REQUIRE(found);
  const Vector6<double> error = found->T_keyframe_camera.boxminus(truth);
  CHECK(error.head<3>().norm() < 0.01);
  CHECK(error.tail<3>().norm() < 0.2);
  REQUIRE(found->agrees.size() == 100);
  int right = 0;
  for (std::size_t i = 0; i < 100; ++i) {
    if (i < 40) CHECK(found->agrees[i] == 0);
    if (i >= 40) right += found->agrees[i];
  }
  CHECK(right > 50);
}

TEST_CASE("No pose is found by the flow of few landmarks, or if they do not agree",
          "[stereo_slam][associate]") {
  std::mt19937_64 random(2);
  const Pose truth = test::car_motion(1.5);
  const FlowScene few(random, truth, 10, 0);
  CHECK_FALSE(pose_by_flow(few.predicted, few.flow, few.scene.map(), {}));
  FlowScene lost(random, truth, 60, 0);
  for (auto& flow : lost.flow) flow.reset();
  CHECK_FALSE(pose_by_flow(lost.predicted, lost.flow, lost.scene.map(), {}));
  const FlowScene disagreeing(random, truth, 100, 80);
  CHECK_FALSE(pose_by_flow(disagreeing.predicted, disagreeing.flow, disagreeing.scene.map(), {}));
}

}  // namespace
}  // namespace stereo_slam
