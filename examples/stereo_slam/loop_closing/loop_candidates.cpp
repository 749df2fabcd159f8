// SPDX-License-Identifier: MIT
#include "stereo_slam/loop_closing/loop_candidates.hpp"

#include <algorithm>

namespace stereo_slam {
namespace {

constexpr double kViewRadius_m =
    10.0;  // within which keyframes are candidates by their pose, without descriptors
constexpr double kMinShareInView = 0.5;  // of the points of such a candidate that project into the image

/// Share of the points of one keyframe that project into the image of another.
[[nodiscard]] double share_in_view(const Keyframe& keyframe, const Keyframe& viewer,
                                   const StereoCamera& camera) {
  const Pose T_viewer_keyframe = viewer.T_world_keyframe.pose.inverse() * keyframe.T_world_keyframe.pose;
  std::size_t count = 0;
  for (const auto& point : keyframe.points) {
    const auto z = camera.project(T_viewer_keyframe * camera.back_project(measurement(point)));
    if (z && camera.in_view(*z)) ++count;
  }
  return static_cast<double>(count) / static_cast<double>(std::max<std::size_t>(keyframe.points.size(), 1));
}

}  // namespace

std::vector<std::size_t> LoopCandidates::find(const Keyframe& keyframe, const KeyframeGraph& graph) const {
  constexpr std::size_t kTrackedLandmarks = 10;
  const std::size_t end = comparable_keyframes(keyframe, graph);
  std::vector<std::size_t> candidates;
  for (const auto& place : places_.query(keyframe.points, end).candidates) {
    candidates.push_back(place.keyframe);
  }
  const auto in_view = most_in_view(keyframe, graph, end);
  if (in_view && std::find(candidates.begin(), candidates.end(), *in_view) == candidates.end()) {
    candidates.push_back(*in_view);
  }
  std::erase_if(candidates, [&](std::size_t candidate) {
    return shared_landmarks(graph[candidate], keyframe) >= kTrackedLandmarks;
  });
  return candidates;
}

/// Number of keyframes, from the first, that a loop may lead to: those that are old enough or, in a segment
/// whose place is not known, all before the segment.
std::size_t LoopCandidates::comparable_keyframes(const Keyframe& keyframe, const KeyframeGraph& graph) const {
  if (!graph.localised(keyframe)) return graph.segments().first_keyframe(keyframe.segment);
  const auto gap = static_cast<std::size_t>(settings_.min_gap_frames);
  std::size_t count = keyframe.id;
  while (count > 0 && graph[count - 1].frame + gap > keyframe.frame) --count;
  return count;
}

/// The paper's trigger: of the nearby keyframes with ids below `end`, the one with the largest share of
/// points in view.
std::optional<std::size_t> LoopCandidates::most_in_view(const Keyframe& keyframe, const KeyframeGraph& graph,
                                                        std::size_t end) const {
  const Vector3<double> position = keyframe.T_world_keyframe.pose.translation();
  std::optional<std::size_t> best;
  double best_share = kMinShareInView;
  for (std::size_t id = 0; id < end; ++id) {
    const Keyframe& old = graph[id];
    if (!graph.segments().joined(old.segment, keyframe.segment)) continue;
    if ((old.T_world_keyframe.pose.translation() - position).norm() > kViewRadius_m) continue;
    const double share = share_in_view(old, keyframe, camera_);
    if (share <= best_share) continue;
    best = id;
    best_share = share;
  }
  return best;
}

}  // namespace stereo_slam
