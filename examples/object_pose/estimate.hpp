// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "pose_evidence.hpp"

namespace object_pose {

struct EstimateSettings {
  EvidenceSettings evidence;
  std::size_t max_features = 8;     ///< to fuse; refused ones do not count
  std::size_t max_components = 10;  ///< left after each fusion
  double min_weight = 1e-3;         ///< lighter components are dropped
  /// Prior probability that a match is wrong.
  double mismatch_rate = 0.1;
  /// How certain it must be that a feature is no mismatch: others will follow.
  double certainty = 0.999;
};

enum class Verdict {
  kFirst,    ///< nothing to compare it with
  kFused,    ///< agrees with the belief
  kRefused,  ///< not certain enough to be no mismatch
  kRestart,  ///< refused, and the belief given up: more features in succession contradict it than made it
};

/// What became of a feature.
struct Stage {
  std::size_t match;  ///< index
  Verdict verdict;
  std::size_t pairs = 0;       ///< of the belief's components and the feature's
  std::size_t compatible = 0;  ///< of them, with tangent points near enough
  std::size_t dropped = 0, merged = 0;
  /// log of how much more probable the feature is if it belongs to the object as believed than if it is
  /// a mismatch.
  double log_evidence = 0.0;
  std::optional<Belief> before;  ///< the belief that it was fused with
  Belief feature;                ///< the object's pose given this feature alone
  Belief after;                  ///< the belief from now on
};

/// Fuses one feature after another (MPG sec. VI, Figs. 3-6), in the order of the matches.
[[nodiscard]] std::vector<Stage> estimate_pose(const std::vector<Match>& matches, const FeatureModel& model,
                                               const BoxSize& size_m, const StereoCamera& camera,
                                               const EstimateSettings& settings = {});

/// How many features the last belief is made of.
[[nodiscard]] std::size_t supporting_features(const std::vector<Stage>& stages);

}  // namespace object_pose
