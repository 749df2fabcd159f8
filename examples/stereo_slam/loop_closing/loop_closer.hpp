// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "stereo_slam/core/pose_estimate.hpp"
#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/loop_closing/keyframe.hpp"
#include "stereo_slam/loop_closing/keyframe_graph.hpp"
#include "stereo_slam/loop_closing/landmark_identity.hpp"
#include "stereo_slam/loop_closing/loop_candidates.hpp"
#include "stereo_slam/loop_closing/loop_verification.hpp"
#include "stereo_slam/loop_closing/map_ids.hpp"
#include "stereo_slam/loop_closing/pose_graph.hpp"
#include "stereo_slam/loop_closing/saved_map.hpp"
#include "stereo_slam/settings/settings.hpp"

namespace stereo_slam {

/// Effect of loops on the map. All values are of the time of the correction.
struct LoopCorrection {
  std::vector<LinkedPose> T_world_keyframe;   ///< of the run's first keyframes; later ones keep their poses
                                              ///< relative to the last of them
  std::vector<Pose> T_world_loaded_keyframe;  ///< of the loaded map's keyframes
  std::vector<bool> segment_localised;        ///< of each of the run's segments; see MapSegments
  LandmarkIdentity identity;                  ///< landmarks united by all loops so far, by their ids in the
                                              ///< saved map
};

/// Closes loops: takes keyframes one by one and returns corrections (sec. IV-F). The stages are the choice of
/// candidates, verification, consistency over consecutive keyframes, a gate on the pose graph's prediction,
/// and pose-graph optimisation.
///
/// A loss of tracking begins a segment, whose pose relative to the one before is a guess. The first loop
/// between two segments is not compared with the guess but replaces it (see KeyframeGraph). While the
/// camera's place is not known, one loop with many inliers is enough for that.
class LoopCloser {
 public:
  /// `loaded` is the map of an earlier run, or empty. Its keyframes, segments and landmarks precede those of
  /// this run in all ids. Keyframes handed in and corrections returned use the ids of this run alone. The
  /// run's first segment is localised when loops have joined it with the loaded map.
  LoopCloser(const StereoCamera& camera, const Settings& settings, const SavedMap& loaded, MapUse use);

  /// Adds the next keyframe. Returns a correction if enough loops were accepted since the last one.
  [[nodiscard]] std::optional<LoopCorrection> process(Keyframe keyframe);

  /// Replaces the poses of this run's keyframes relative to the keyframes before them. If there are loops,
  /// the next correction takes the new poses into account.
  void replace(std::vector<KeyframeLink> links);

  /// The correction for the accepted loops and replaced poses that still wait for one; nothing if none does.
  [[nodiscard]] std::optional<LoopCorrection> correct();

  /// Loops found so far, accepted and refused, in order.
  [[nodiscard]] const std::vector<LoopEvent>& events() const noexcept { return events_; }
  /// Memory of keyframes and place recognition, bytes.
  [[nodiscard]] std::size_t memory_bytes() const {
    return graph_.memory_bytes() + candidates_.memory_bytes();
  }

  /// Sets the keyframes and the loops of `map`; those of the loaded map come first.
  void save(SavedMap& map) const;

 private:
  const Keyframe& add_keyframe(Keyframe keyframe);
  [[nodiscard]] bool follows_last_loop(const Keyframe& keyframe) const;
  [[nodiscard]] std::optional<LoopMeasurement> verify(const Keyframe& keyframe,
                                                      const std::vector<std::size_t>& candidates) const;
  [[nodiscard]] std::vector<LoopMeasurement> confirm(const std::optional<LoopMeasurement>& loop);
  [[nodiscard]] std::vector<LoopMeasurement> gate(const std::vector<LoopMeasurement>& loops);
  [[nodiscard]] double gate_distance(const PoseGraphEdge& loop, const LoopPrediction& prediction) const;
  void accept(const std::vector<LoopMeasurement>& loops);
  [[nodiscard]] bool correction_needed(const std::vector<LoopMeasurement>& confirmed,
                                       bool newly_localised) const;
  [[nodiscard]] LoopCorrection correction_to(const std::vector<LinkedPose>& poses) const;

  StereoCamera camera_;
  Settings settings_;
  MapIds ids_;
  KeyframeGraph graph_;
  LoopCandidates candidates_;
  LoopConsistency consistency_;
  LandmarkIdentity identity_;
  std::vector<LoopEvent> events_;
  std::size_t waiting_loops_ = 0;  // number of accepted loops that no correction contains yet
  bool links_replaced_ = false;    // since the last correction
};

}  // namespace stereo_slam
