// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "pose_evidence.hpp"

namespace object_pose {

/// How many features are fused, and when one is refused.
struct EstimateSettings {
  EvidenceSettings evidence;
  std::size_t max_features = 8;     ///< to fuse; refused ones do not count
  std::size_t max_components = 10;  ///< left after each fusion
  double min_weight = 1e-3;         ///< lighter components are dropped
  /// Prior probability that a match is a mismatch.
  double mismatch_rate = 0.1;
  /// Smallest probability of being no mismatch with which a feature is fused.
  double certainty = 0.999;
};

/// Whether a feature is fused into the belief.
enum class Verdict {
  kFirst,    ///< the first feature of a belief
  kFused,    ///< agrees with the belief, and is fused
  kRefused,  ///< may be a mismatch
  kRestart,  ///< refused, and the belief is discarded: more features in succession were refused than fused
};

/// One feature: the verdict, and the belief before and after.
struct Stage {
  std::size_t match;  ///< index in the matches
  Verdict verdict;
  std::size_t pairs = 0;                ///< all pairs of a component of the belief and one of the feature
  std::size_t compatible = 0;           ///< pairs that the gate accepts
  std::size_t dropped = 0, merged = 0;  ///< components dropped and pairs merged after the fusion
  /// log of the ratio of two likelihoods: that of the feature as a part of the object as believed, and that
  /// of the feature as a mismatch.
  double log_evidence = 0.0;
  std::optional<Belief> before;  ///< the belief without this feature; none for the first
  Belief feature;                ///< the object's pose given this feature alone
  Belief after;                  ///< the belief after this feature
};

/// Fuses one feature after another (MPG sec. VI, Figs. 3-6), in the order of the matches.
[[nodiscard]] std::vector<Stage> estimate_pose(const std::vector<Match>& matches, const FeatureModel& model,
                                               const BoxSize& size_m, const StereoCamera& camera,
                                               const EstimateSettings& settings = {});

/// Number of features that the last belief was fused from.
[[nodiscard]] std::size_t supporting_features(const std::vector<Stage>& stages);

}  // namespace object_pose
