// SPDX-License-Identifier: MIT
#include "stereo_slam/loop_closing/keyframe_graph.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

namespace stereo_slam {

void KeyframeGraph::load(const SavedMap& map, MapUse use) {
  std::vector<PoseGaussian> poses;
  for (const auto& keyframe : map.keyframes) {
    add(keyframe);
    poses.push_back(keyframe.T_world_keyframe);
  }
  correct(poses);
  for (const auto& loop : map.loops) segments_.join(segment_of(loop.from), segment_of(loop.to));
  drop_guesses();
  loops_ = map.loops;
  first_of_run_ = keyframes_.size();
  if (use == MapUse::kLocalise) fixed_keyframes_ = map.keyframes.size();
}

std::size_t KeyframeGraph::add(Keyframe keyframe) {
  const std::size_t id = keyframes_.size();
  keyframe.id = id;
  if (keyframe.points.size() > max_points_) keyframe.points.resize(max_points_);
  keyframe.points.shrink_to_fit();
  const bool begins_segment = keyframe.segment >= segments_.size();
  if (id > 0) {
    const Keyframe& previous = keyframes_.back();
    if (keyframe.frame <= previous.frame) {
      throw std::invalid_argument(
          fmt::format("keyframe of frame {} follows one of frame {}: frames must increase", keyframe.frame,
                      previous.frame));
    }
    keyframe.T_world_keyframe = compose_first_order(previous.T_world_keyframe, keyframe.T_previous_keyframe);
    keyframe.path_length_m = previous.path_length_m + keyframe.T_previous_keyframe.pose.translation().norm();
    odometry_.push_back({id - 1, id, keyframe.T_previous_keyframe, !begins_segment, keyframe.tilt});
  }
  if (begins_segment) segments_.begin(id);
  keyframes_.push_back(std::move(keyframe));
  return id;
}

/// Sets the poses of the first keyframes; later ones keep their poses relative to the one before.
void KeyframeGraph::correct(const std::vector<PoseGaussian>& T_world_keyframe) {
  for (std::size_t id = 0; id < keyframes_.size(); ++id) {
    if (id < T_world_keyframe.size()) {
      keyframes_[id].T_world_keyframe = T_world_keyframe[id];
    } else if (id > 0) {
      keyframes_[id].T_world_keyframe =
          compose_first_order(keyframes_[id - 1].T_world_keyframe, keyframes_[id].T_previous_keyframe);
    }
  }
}

PoseGaussian KeyframeGraph::unknown_link() const {
  return {keyframes_.back().T_world_keyframe.pose.inverse(), unknown_pose_covariance()};
}

void KeyframeGraph::join_segments(const PoseGraphEdge& loop) {
  if (segments_.joined(segment_of(loop.from), segment_of(loop.to))) return;
  const auto motions = segment_motions(loop);
  std::vector<PoseGaussian> poses;
  for (const auto& keyframe : keyframes_) {
    poses.push_back(keyframe.T_world_keyframe);
    const auto& motion = motions[keyframe.segment];
    if (motion) poses.back().pose = (*motion * poses.back().pose).renormalized();
  }
  correct(poses);
  segments_.join(segment_of(loop.from), segment_of(loop.to));
  drop_guesses();
}

/// How each segment moves, in world coordinates, when a loop joins two of them; nothing if it stays. The
/// later of the two, and those joined with it, move so that they satisfy the loop. A segment whose pose
/// relative to the one before is a guess moves with the one before.
std::vector<std::optional<Pose>> KeyframeGraph::segment_motions(const PoseGraphEdge& loop) const {
  const std::size_t from = segments_.root(segment_of(loop.from));
  const std::size_t to = segments_.root(segment_of(loop.to));
  const Pose& T_world_from = keyframes_[loop.from].T_world_keyframe.pose;
  const Pose& T_world_to = keyframes_[loop.to].T_world_keyframe.pose;
  const Pose motion = to > from ? T_world_from * loop.T_from_to.pose * T_world_to.inverse()
                                : T_world_to * loop.T_from_to.pose.inverse() * T_world_from.inverse();
  std::vector<std::optional<Pose>> motions;
  for (std::size_t s = 0; s < segments_.size(); ++s) {
    const std::size_t root = segments_.root(s);
    if (root == std::max(from, to)) {
      motions.emplace_back(motion);
    } else if (root < s) {  // joined with an earlier segment
      motions.push_back(motions[root]);
    } else {
      motions.push_back(s == 0 ? std::nullopt : motions[s - 1]);
    }
  }
  return motions;
}

/// Replaces the guessed odometry edges between joined segments by edges with the present relative poses and
/// practically no information.
void KeyframeGraph::drop_guesses() {
  for (std::size_t s = 1; s < segments_.size(); ++s) {
    if (!segments_.joined(s - 1, s)) continue;
    auto& guess = odometry_[segments_.first_keyframe(s) - 1];
    const Pose& T_world_from = keyframes_[guess.from].T_world_keyframe.pose;
    const Pose& T_world_to = keyframes_[guess.to].T_world_keyframe.pose;
    guess.T_from_to = {(T_world_from.inverse() * T_world_to).renormalized(), unknown_pose_covariance()};
    guess.measured = false;
  }
}

void KeyframeGraph::replace(const std::vector<KeyframeLink>& links) {
  if (links.empty()) return;
  for (const auto& [id, T_previous_keyframe, tilt] : links) {
    keyframes_.at(id).T_previous_keyframe = T_previous_keyframe;
    keyframes_[id].tilt = odometry_[id - 1].tilt = tilt;
    odometry_[id - 1].T_from_to = T_previous_keyframe;
  }
  if (!loops_.empty()) return;
  std::vector<PoseGaussian> poses_before;
  for (std::size_t id = 0; id < links.front().keyframe; ++id) {
    poses_before.push_back(keyframes_[id].T_world_keyframe);
  }
  correct(poses_before);
}

std::size_t KeyframeGraph::memory_bytes() const {
  std::size_t bytes = keyframes_.capacity() * sizeof(Keyframe);
  for (const auto& keyframe : keyframes_) bytes += keyframe.points.capacity() * sizeof(KeyframePoint);
  return bytes;
}

double KeyframeGraph::path_length_m(std::size_t from, std::size_t to) const {
  const auto along_trajectory_m = [&](std::size_t a, std::size_t b) {
    return std::abs(keyframes_[a].path_length_m - keyframes_[b].path_length_m);
  };
  double shortest_m = along_trajectory_m(from, to);
  for (const auto& loop : loops_) {
    shortest_m = std::min(shortest_m, along_trajectory_m(from, loop.from) + along_trajectory_m(loop.to, to));
  }
  return shortest_m;
}

PoseGraph KeyframeGraph::pose_graph() const {
  PoseGraph graph{.poses = {},
                  .odometry = odometry_,
                  .loops = loops_,
                  .first = first_of_run_,
                  .gauge = fixed_keyframes_,
                  .common_error_rad = common_error_rad_};
  for (const auto& keyframe : keyframes_) graph.poses.push_back(keyframe.T_world_keyframe.pose);
  return graph;
}

std::vector<LinkedPose> KeyframeGraph::optimize(const PoseGraphSettings& settings) {
  PoseGraph graph = pose_graph();
  graph.poses = stereo_slam::optimize(graph, settings).poses;
  auto poses = with_covariances(graph, settings);
  std::vector<PoseGaussian> estimates;
  estimates.reserve(poses.size());
  for (const auto& pose : poses) estimates.push_back(pose.estimate);
  correct(estimates);
  return poses;
}

/// Poses of an optimised graph with their marginal covariances. If these cannot be computed, each covariance
/// is composed from that of the keyframe before and the odometry, without the information of the loops.
std::vector<LinkedPose> KeyframeGraph::with_covariances(const PoseGraph& graph,
                                                        const PoseGraphSettings& settings) const {
  auto result = marginals(graph, settings);
  const bool known = !result.empty();
  result.resize(graph.poses.size());
  for (std::size_t id = 0; id < result.size(); ++id) {
    if (id < graph.gauge) {
      result[id] = {{graph.poses[id], keyframes_[id].T_world_keyframe.covariance}};
    } else if (!known) {
      const Pose T_previous_keyframe = graph.poses[id - 1].inverse() * graph.poses[id];
      result[id] = add_link(result[id - 1],
                            PoseGaussian{T_previous_keyframe, keyframes_[id].T_previous_keyframe.covariance},
                            odometry_[id - 1].measured);
      result[id].estimate.pose = graph.poses[id];
    }
  }
  return result;
}

}  // namespace stereo_slam
