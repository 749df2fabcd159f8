// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/loop_closing/keyframe.hpp"
#include "stereo_slam/loop_closing/keyframe_graph.hpp"
#include "stereo_slam/loop_closing/place_recognition.hpp"
#include "stereo_slam/settings/settings.hpp"

namespace stereo_slam {

/// Finds the earlier keyframes that may show the place of a new one, in two ways: by descriptors, whatever
/// the drift, and as in the paper by position: the nearby keyframe with the largest share of points in view
/// of the new one.
class LoopCandidates {
 public:
  /// Starts empty. All keyframes are from `camera`.
  LoopCandidates(const StereoCamera& camera, const PlaceRecognitionSettings& settings)
      : camera_(camera), settings_(settings), places_(settings) {}

  /// Adds a keyframe to those that place recognition finds. Keyframes come in order of their ids.
  void add(const Keyframe& keyframe) { places_.add(keyframe.id, keyframe.points); }

  /// Ids of the candidates for a loop with `keyframe`, the last one of the graph. They are old enough or,
  /// while the place of the keyframe's segment is not known, of earlier segments. A keyframe that shares
  /// tracked landmarks with it never went out of view and is no candidate.
  [[nodiscard]] std::vector<std::size_t> find(const Keyframe& keyframe, const KeyframeGraph& graph) const;

  /// Memory of place recognition, bytes.
  [[nodiscard]] std::size_t memory_bytes() const { return places_.memory_bytes(); }

 private:
  [[nodiscard]] std::size_t comparable_keyframes(const Keyframe& keyframe, const KeyframeGraph& graph) const;
  [[nodiscard]] std::optional<std::size_t> most_in_view(const Keyframe& keyframe, const KeyframeGraph& graph,
                                                        std::size_t end) const;

  StereoCamera camera_;
  PlaceRecognitionSettings settings_;
  PlaceRecognition places_;
};

}  // namespace stereo_slam
