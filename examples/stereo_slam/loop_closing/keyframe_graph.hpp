// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "stereo_slam/core/pose_estimate.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/loop_closing/keyframe.hpp"
#include "stereo_slam/loop_closing/map_segments.hpp"
#include "stereo_slam/loop_closing/pose_graph.hpp"
#include "stereo_slam/loop_closing/saved_map.hpp"
#include "stereo_slam/settings/settings.hpp"

namespace stereo_slam {

/// The keyframes of a map with their poses, and the constraints between them: the odometry between
/// consecutive keyframes, and accepted loops. All ids are those of the map.
///
/// The pose of a map segment relative to the one before is a guess. The first loop between two segments
/// replaces it: the later segment moves as a whole to where the loop measures it.
class KeyframeGraph {
 public:
  /// At most `max_points` points of a keyframe are kept. `common_error_rad` is the standard deviation
  /// of the odometry's common error (LinkedPose).
  KeyframeGraph(std::size_t max_points, double common_error_rad)
      : max_points_(max_points), common_error_rad_(common_error_rad) {}

  /// Adds the keyframes and the loops of a saved map to an empty graph. With MapUse::kLocalise the poses of
  /// these keyframes stay fixed.
  void load(const SavedMap& map, MapUse use);

  /// Appends a keyframe and returns its id. It begins a segment if its segment is new. Its id,
  /// T_world_keyframe and path length are computed here, from the keyframe before. Throws
  /// std::invalid_argument if its frame is not later than the frame of the keyframe before.
  std::size_t add(Keyframe keyframe);

  /// For a next keyframe whose pose relative to the last one is unknown: a relative pose that puts it at the
  /// origin of the world, with practically no information. The graph is not empty.
  [[nodiscard]] PoseGaussian unknown_link() const;

  /// Number of keyframes.
  [[nodiscard]] std::size_t size() const noexcept { return keyframes_.size(); }
  /// The keyframe with this id, which is less than size(). The reference is valid until the next add().
  [[nodiscard]] const Keyframe& operator[](std::size_t id) const { return keyframes_[id]; }
  /// All keyframes, by id.
  [[nodiscard]] const std::vector<Keyframe>& keyframes() const noexcept { return keyframes_; }
  /// The map segments that the keyframes form.
  [[nodiscard]] const MapSegments& segments() const noexcept { return segments_; }
  /// The accepted loops, in the order in which they were added.
  [[nodiscard]] const std::vector<PoseGraphEdge>& loops() const noexcept { return loops_; }
  /// Whether the pose of the keyframe's segment in the world is known.
  [[nodiscard]] bool localised(const Keyframe& keyframe) const {
    return segments_.localised(keyframe.segment);
  }

  /// Joins the segments of two keyframes by their first loop: the later segment, and those joined with it,
  /// move so that they satisfy the loop. No effect on segments that are joined already.
  void join_segments(const PoseGraphEdge& loop);

  /// Adds an accepted loop as a constraint. Poses stay the same until optimize() is called.
  void add_loop(const PoseGraphEdge& loop) { loops_.push_back(loop); }

  /// Replaces the odometry of keyframes; `links` are in order of keyframes, without the first one. If there
  /// are loops, poses in the world stay the same until optimize() is called. If there are none, they are
  /// composed anew. Throws std::out_of_range if there is no such keyframe.
  void replace(const std::vector<KeyframeLink>& links);

  /// Memory of all keyframes, bytes.
  [[nodiscard]] std::size_t memory_bytes() const;

  /// Length of the shortest path between two keyframes, m: along the trajectory, or over one loop.
  [[nodiscard]] double path_length_m(std::size_t from, std::size_t to) const;

  /// The poses and the constraints.
  [[nodiscard]] PoseGraph pose_graph() const;

  /// Moves the keyframes to the poses that fit the constraints best, and returns these poses.
  std::vector<LinkedPose> optimize(const PoseGraphSettings& settings);

 private:
  void correct(const std::vector<PoseGaussian>& T_world_keyframe);
  [[nodiscard]] std::size_t segment_of(std::size_t keyframe) const { return keyframes_[keyframe].segment; }
  [[nodiscard]] std::vector<std::optional<Pose>> segment_motions(const PoseGraphEdge& loop) const;
  void drop_guesses();
  [[nodiscard]] std::vector<LinkedPose> with_covariances(const PoseGraph& graph,
                                                         const PoseGraphSettings& settings) const;

  std::size_t max_points_;  // of a keyframe
  std::vector<Keyframe> keyframes_;
  MapSegments segments_;
  std::vector<PoseGraphEdge> odometry_;  // edge k leads from keyframe k to k + 1
  std::vector<PoseGraphEdge> loops_;     // accepted
  std::size_t first_of_run_ = 0;         // after those of the loaded map
  std::size_t fixed_keyframes_ = 1;      // gauge of the pose graph
  double common_error_rad_;
};

}  // namespace stereo_slam
