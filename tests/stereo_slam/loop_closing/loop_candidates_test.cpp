// SPDX-License-Identifier: MIT
#include "stereo_slam/loop_closing/loop_candidates.hpp"

#include <random>

#include "stereo_slam/support/random_map.hpp"
#include "stereo_slam/support/scenes.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

constexpr std::size_t kPointsPerView = 40;
const PlaceRecognitionSettings kPlaces{.min_gap_frames = 60};

/// Two keyframes with points of their own, the second ahead of the first by a distance and by frames.
std::vector<Keyframe> two_keyframes(double distance_m, std::size_t frames) {
  std::mt19937_64 random(3);
  std::vector<Keyframe> keyframes(2);
  for (auto& keyframe : keyframes) keyframe.points = test::points_of(kPointsPerView, random);
  keyframes[1].frame = frames;
  keyframes[1].T_previous_keyframe = test::estimate(distance_m, 1e-4);
  return keyframes;
}

/// The candidates of the last keyframe.
std::vector<std::size_t> find_candidates(const std::vector<Keyframe>& keyframes) {
  KeyframeGraph graph(kPointsPerView, 0.0);
  LoopCandidates candidates(test::kitti_camera(), kPlaces);
  for (const auto& keyframe : keyframes) {
    if (graph.size() > 0) candidates.add(graph.keyframes().back());
    graph.add(keyframe);
  }
  return candidates.find(graph.keyframes().back(), graph);
}

const std::vector<std::size_t> kNoCandidates{};
const std::vector<std::size_t> kFirstKeyframe{0};

TEST_CASE("A nearby old keyframe with its points in view is a candidate", "[stereo_slam][loops]") {
  CHECK(find_candidates(two_keyframes(0.1, 100)) == kFirstKeyframe);
  CHECK(find_candidates(two_keyframes(0.1, 59)) == kNoCandidates);    // too recent
  CHECK(find_candidates(two_keyframes(50.0, 100)) == kNoCandidates);  // too far
}

TEST_CASE("A keyframe that looks alike is a candidate at any distance", "[stereo_slam][loops]") {
  auto keyframes = two_keyframes(50.0, 100);
  for (std::size_t i = 0; i < kPointsPerView; ++i) {
    keyframes[1].points[i].descriptor = keyframes[0].points[i].descriptor;
  }
  CHECK(find_candidates(keyframes) == kFirstKeyframe);
  keyframes[1].T_previous_keyframe = test::estimate(0.1, 1e-4);
  CHECK(find_candidates(keyframes) == kFirstKeyframe);  // found in both ways, listed once
}

TEST_CASE("A keyframe whose landmarks are still tracked is no candidate", "[stereo_slam][loops]") {
  auto keyframes = two_keyframes(0.1, 100);
  for (std::size_t i = 0; i < 10; ++i) keyframes[1].points[i].landmark = keyframes[0].points[i].landmark;
  CHECK(find_candidates(keyframes) == kNoCandidates);
}

TEST_CASE("A lost camera compares itself with recent keyframes, too", "[stereo_slam][loops]") {
  auto keyframes = two_keyframes(0.1, 20);
  for (std::size_t i = 0; i < kPointsPerView; ++i) {
    keyframes[1].points[i].descriptor = keyframes[0].points[i].descriptor;
  }
  CHECK(find_candidates(keyframes) == kNoCandidates);
  keyframes[1].segment = 1;
  CHECK(find_candidates(keyframes) == kFirstKeyframe);
}

}  // namespace
}  // namespace stereo_slam
