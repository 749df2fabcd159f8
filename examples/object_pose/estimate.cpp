// SPDX-License-Identifier: MIT
#include "estimate.hpp"

#include <cmath>
#include <deque>
#include <limits>
#include <numbers>
#include <utility>

#include <antipode/distributions/mixture_reduction.hpp>

namespace object_pose {
namespace {

/// Log of the density of the object's pose given a mismatch: uniform over all orientations and over positions
/// at most a diagonal of the box away.
double log_mismatch_density(const BoxSize& size_m) {
  constexpr double kSphereArea = 2.0 * std::numbers::pi * std::numbers::pi;
  const double reach_m = size_m.norm();
  const double volume_m3 = 4.0 / 3.0 * std::numbers::pi * reach_m * reach_m * reach_m;
  return -std::log(kSphereArea * volume_m3);
}

double log_odds(double probability) { return std::log(probability / (1.0 - probability)); }

Stage first_stage(std::size_t match, const Belief& feature) {
  return {.match = match,
          .verdict = Verdict::kFirst,
          .before = std::nullopt,
          .feature = feature,
          .after = feature};
}

/// Fuses in the feature's frame. The lever arm between feature and object then applies to the belief, which
/// becomes narrow, and not to the wide rotation of the base elements.
Stage fuse_feature(std::size_t match, const Belief& belief, const FeatureEvidence& feature,
                   const BoxSize& size_m, const EstimateSettings& settings) {
  Stage stage{.match = match,
              .verdict = Verdict::kRefused,
              .pairs = belief.size() * feature.T_camera_feature.size(),
              .log_evidence = -std::numeric_limits<double>::infinity(),
              .before = belief,
              .feature = feature.T_camera_object,
              .after = belief};
  const auto fused =
      antipode::try_fuse(compose_with_lever(belief, feature.T_object_feature), feature.T_camera_feature,
                         {.gate = antipode::PlausibilityGate::kTapered});
  if (!fused) return stage;
  stage.compatible = fused->mixture.size();
  stage.log_evidence = fused->log_mass - log_mismatch_density(size_m);
  if (stage.log_evidence < log_odds(settings.mismatch_rate) + log_odds(settings.certainty)) return stage;

  const auto reduced = antipode::reduce(
      fused->mixture, {.max_components = settings.max_components, .min_weight = settings.min_weight});
  stage.verdict = Verdict::kFused;
  stage.dropped = static_cast<std::size_t>(reduced.dropped);
  stage.merged = static_cast<std::size_t>(reduced.merged);
  stage.after = compose_with_lever(reduced.mixture, feature.T_object_feature.inverse());
  return stage;
}

}  // namespace

std::vector<Stage> estimate_pose(const std::vector<Match>& matches, const FeatureModel& model,
                                 const BoxSize& size_m, const StereoCamera& camera,
                                 const EstimateSettings& settings) {
  std::deque<std::size_t> waiting;
  for (std::size_t k = 0; k < matches.size(); ++k) waiting.push_back(k);
  std::vector<Stage> stages;
  std::vector<std::size_t> refused;  // by the current belief
  std::size_t fused = 0, refused_in_succession = 0;
  while (!waiting.empty() && fused < settings.max_features) {
    const std::size_t match = waiting.front();
    waiting.pop_front();
    const FeatureEvidence feature = evidence_of(matches[match], model, camera, settings.evidence);
    if (fused == 0) {
      stages.push_back(first_stage(match, feature.T_camera_object));
      fused = 1;
      continue;
    }
    stages.push_back(fuse_feature(match, stages.back().after, feature, size_m, settings));
    if (stages.back().verdict == Verdict::kFused) {
      ++fused;
      refused_in_succession = 0;
      continue;
    }
    refused.push_back(match);
    if (++refused_in_succession <= fused) continue;
    // Mismatches agree with each other now and then, but not for long.
    stages.back().verdict = Verdict::kRestart;
    waiting.insert(waiting.begin(), refused.begin(), refused.end());
    refused.clear();
    fused = refused_in_succession = 0;
  }
  return stages;
}

std::size_t supporting_features(const std::vector<Stage>& stages) {
  std::size_t count = 0;
  for (const auto& stage : stages) {
    if (stage.verdict == Verdict::kFirst) count = 0;
    if (stage.verdict == Verdict::kFirst || stage.verdict == Verdict::kFused) ++count;
    if (stage.verdict == Verdict::kRestart) count = 0;
  }
  return count;
}

}  // namespace object_pose
