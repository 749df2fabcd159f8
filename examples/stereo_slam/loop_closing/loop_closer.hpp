// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/keyframes/keyframe_database.hpp"
#include "stereo_slam/loop_closing/landmark_identity.hpp"
#include "stereo_slam/loop_closing/loop_verification.hpp"
#include "stereo_slam/loop_closing/map_segments.hpp"
#include "stereo_slam/loop_closing/place_recognition.hpp"
#include "stereo_slam/loop_closing/pose_graph.hpp"
#include "stereo_slam/loop_closing/saved_map.hpp"
#include "stereo_slam/settings/settings.hpp"

namespace stereo_slam {

/// New poses T_world_keyframe of the first keyframes; those after them keep their poses relative to the last.
struct LoopCorrection {
  std::vector<PoseGaussian> T_world_keyframe;
  std::vector<Pose> T_world_known_keyframe;  ///< those of the map that the run started with
  std::vector<bool> segment_placed;  ///< of every segment so far: it is joined with the one of the world
  LandmarkIdentity identity;         ///< ids of landmarks that loops have shown to be the same, so far
};

/// From one keyframe after the other to corrections: recognition, verification, consistency, gate and pose
/// graph (sec. IV-F).
///
/// A keyframe of a new segment is connected to the one before by a guess, with a covariance that a camera
/// carried elsewhere in the dark does not keep to. The first loop between two segments is therefore not
/// compared with it, but replaces it: the later segment moves to where the loop says, as a whole.
class LoopCloser {
 public:
  /// Starts with what another run left behind, or with nothing. Its frames, segments and ids come before
  /// those of this run, which know nothing of them: the keyframes that are handed in and the corrections that
  /// come out are of this run alone, and its first segment is placed when loops have joined it with the map.
  LoopCloser(const StereoCamera& camera, const Settings& settings, const SavedMap& known, MapUse use);

  /// Takes the next keyframe; what it brings, if it brings anything.
  [[nodiscard]] std::optional<LoopCorrection> process(Keyframe keyframe);

  /// Lets the loops take effect that wait for more.
  [[nodiscard]] std::optional<LoopCorrection> correct();

  [[nodiscard]] const std::vector<LoopEvent>& events() const noexcept { return events_; }
  [[nodiscard]] std::size_t memory_bytes() const;

  /// Adds keyframes and loops, those that it started with first.
  void save(SavedMap& map) const;

 private:
  void start_with(const SavedMap& known, MapUse use);
  void follow_known_map(Keyframe& keyframe) const;
  void add_node(const Keyframe& keyframe);
  [[nodiscard]] std::size_t segment_of(std::size_t keyframe) const { return keyframes_[keyframe].segment; }

  [[nodiscard]] std::size_t comparable_keyframes(const Keyframe& keyframe) const;
  [[nodiscard]] std::optional<std::size_t> most_in_view(const Keyframe& keyframe, std::size_t end) const;
  [[nodiscard]] std::vector<std::size_t> candidates(const Keyframe& keyframe) const;
  [[nodiscard]] std::optional<LoopMeasurement> measure(const Keyframe& keyframe) const;

  void accept(const std::vector<LoopMeasurement>& loops);
  [[nodiscard]] double contradiction(const PoseGraphEdge& edge) const;
  [[nodiscard]] double way_m(std::size_t from, std::size_t to) const;
  void join(const PoseGraphEdge& loop);
  void drop_guesses();

  [[nodiscard]] std::vector<std::size_t> marginal_nodes() const;
  [[nodiscard]] std::vector<PoseGaussian> with_covariances(const std::vector<Pose>& poses) const;

  StereoCamera camera_;
  Settings settings_;
  KeyframeDatabase keyframes_;
  MapSegments segments_;
  PlaceRecognition places_;
  LoopConsistency consistency_;
  PoseGraph graph_;                // its odometry's edge k leads from keyframe k to k + 1
  std::size_t waiting_loops_ = 0;  // in the graph, but not yet in its poses
  std::vector<LoopEvent> events_;
  MapExtent known_;
  LandmarkIdentity identity_;
};

}  // namespace stereo_slam
