// SPDX-License-Identifier: MIT
#include "stereo_slam/loop_closing/loop_closer.hpp"

#include <algorithm>
#include <utility>

#include "stereo_slam/core/pixel_noise.hpp"
#include "stereo_slam/rig/calibration_error.hpp"

namespace stereo_slam {
namespace {

constexpr int kMaxPoints = 500;  // that a keyframe keeps for place recognition

/// The loop as an edge of the graph, with the covariance that accounts for what its points have in common.
[[nodiscard]] PoseGraphEdge edge_of(const LoopMeasurement& loop) {
  PoseGraphEdge edge{loop.old_keyframe, loop.new_keyframe, loop.T_old_new};
  edge.T_from_to.covariance *= kLoopCovarianceScale;
  return edge;
}

}  // namespace

LoopCloser::LoopCloser(const StereoCamera& camera, const Settings& settings, const SavedMap& loaded,
                       MapUse use)
    : camera_(camera),
      settings_(settings),
      ids_(MapIds::after(loaded)),
      graph_(static_cast<std::size_t>(kMaxPoints),
             allowed_calibration_error(settings.calibration, camera).common_error_rad),
      candidates_(camera, settings.place_recognition),
      consistency_(settings.loop_verification) {
  if (loaded.keyframes.empty()) return;
  graph_.load(loaded, use);
  for (const auto& keyframe : graph_.keyframes()) candidates_.add(keyframe);
}

void LoopCloser::save(SavedMap& map) const {
  map.keyframes = graph_.keyframes();
  map.loops = graph_.loops();
  for (auto& keyframe : map.keyframes) {
    for (auto& point : keyframe.points) point.landmark = identity_(point.landmark);
  }
}

std::optional<LoopCorrection> LoopCloser::process(Keyframe keyframe) {
  const Keyframe& added = add_keyframe(std::move(keyframe));
  const bool was_localised = graph_.localised(added);
  std::vector<LoopMeasurement> confirmed;
  if (!follows_last_loop(added)) {
    const auto candidates = candidates_.find(added, graph_);
    const auto verified = verify(added, candidates);
    confirmed = confirm(verified);
    accept(gate(confirmed));
  }
  candidates_.add(added);
  const bool newly_localised = !was_localised && graph_.localised(added);
  if (!correction_needed(confirmed, newly_localised)) return std::nullopt;
  return correct();
}

/// Adds a keyframe of this run to the graph. The pose of the run's first keyframe relative to the loaded map
/// is unknown.
const Keyframe& LoopCloser::add_keyframe(Keyframe keyframe) {
  const bool is_first_of_run = graph_.size() == ids_.keyframes;
  if (is_first_of_run && graph_.size() > 0) keyframe.T_previous_keyframe = graph_.unknown_link();
  return graph_[graph_.add(ids_.in_map(std::move(keyframe)))];
}

/// Whether a keyframe is so close behind the last loop that another loop would add little information.
bool LoopCloser::follows_last_loop(const Keyframe& keyframe) const {
  if (graph_.loops().empty()) return false;
  const Keyframe& last = graph_[graph_.loops().back().to];
  return last.segment == keyframe.segment &&
         keyframe.path_length_m - last.path_length_m <
             settings_.loop_closure.spacing_baselines * camera_.baseline_m;
}

/// The loop with the most inliers among the candidates that pass the geometric check.
std::optional<LoopMeasurement> LoopCloser::verify(const Keyframe& keyframe,
                                                  const std::vector<std::size_t>& candidates) const {
  std::optional<LoopMeasurement> best;
  for (const std::size_t candidate : candidates) {
    auto verified = verify_loop(graph_[candidate], keyframe, camera_, settings_.loop_verification,
                                settings_.seed + keyframe.id);
    if (verified && (!best || verified->inliers > best->inliers)) best = std::move(verified);
  }
  return best;
}

/// The loops that are certain by now: those that consecutive keyframes agree on. While the camera's place is
/// not known, one that finds it with many inliers is enough, because the camera waits for it.
std::vector<LoopMeasurement> LoopCloser::confirm(const std::optional<LoopMeasurement>& loop) {
  const auto& rule = settings_.loop_verification;
  const bool finds_place =
      loop && graph_.localised(graph_[loop->old_keyframe]) && !graph_.localised(graph_[loop->new_keyframe]);
  if (!finds_place || loop->inliers < rule.relocalisation_inliers) {
    return consistency_.add(loop, graph_.keyframes());
  }
  consistency_ = LoopConsistency(rule);
  return {*loop};
}

/// The loops that agree with the pose graph's prediction. Joins segments that a loop is the first to connect,
/// and records an event for every loop.
std::vector<LoopMeasurement> LoopCloser::gate(const std::vector<LoopMeasurement>& loops) {
  if (loops.empty()) return {};
  for (const auto& loop : loops) graph_.join_segments(edge_of(loop));
  const LoopPrediction prediction(graph_.pose_graph(), settings_.pose_graph);
  std::vector<LoopMeasurement> passed;
  for (const auto& loop : loops) {
    const double chi2 = gate_distance(edge_of(loop), prediction);
    const bool passes = chi2 <= settings_.loop_verification.max_chi2;
    events_.push_back({.frame = ids_.original_frame(graph_[loop.new_keyframe]),
                       .old_frame = ids_.original_frame(graph_[loop.old_keyframe]),
                       .in_loaded_map = ids_.is_loaded(loop.old_keyframe),
                       .inliers = loop.inliers,
                       .chi2 = chi2,
                       .accepted = passes,
                       .T_old_new = loop.T_old_new.pose});
    if (passes) passed.push_back(loop);
  }
  return passed;
}

/// Squared Mahalanobis distance of a loop from the prediction, with covariances increased by the allowance
/// for systematic errors. Zero if nothing is predicted: every measurement is as likely as any other.
double LoopCloser::gate_distance(const PoseGraphEdge& loop, const LoopPrediction& prediction) const {
  if (!prediction.knows(loop.from, loop.to)) return 0.0;
  const auto& rule = settings_.loop_verification;
  const double length_m = graph_.path_length_m(loop.from, loop.to);
  return prediction.mahalanobis_squared(loop, rule.gate_scale, gate_allowance(length_m));
}

/// Makes loops constraints of the graph, and unites the landmarks that both of their keyframes observe.
void LoopCloser::accept(const std::vector<LoopMeasurement>& loops) {
  for (const auto& loop : loops) {
    graph_.add_loop(edge_of(loop));
    for (const auto& [old_landmark, new_landmark] : loop.same_landmarks) {
      identity_.unite(old_landmark, new_landmark);
    }
  }
  waiting_loops_ += loops.size();
}

/// Whether it is time for an optimisation: at once if the camera's place has become known, and for the first
/// loops of a revisit, which consecutive keyframes confirm together. After that, for every kFewestLoops
/// loops, or for more in a large map, so that the computing time per kilometre does not grow with the map.
bool LoopCloser::correction_needed(const std::vector<LoopMeasurement>& confirmed,
                                   bool newly_localised) const {
  constexpr std::size_t kFewestLoops = 2;
  constexpr std::size_t kKeyframesPerLoop = 500;
  const bool revisit_begins = confirmed.size() > 1 && waiting_loops_ > 0;
  const std::size_t enough_loops = std::max(kFewestLoops, graph_.size() / kKeyframesPerLoop);
  return newly_localised || revisit_begins || waiting_loops_ >= enough_loops;
}

void LoopCloser::replace(std::vector<KeyframeLink> links) {
  if (links.empty()) return;
  for (auto& link : links) link.keyframe = ids_.keyframe_in_map(link.keyframe);
  graph_.replace(links);
  links_replaced_ = true;
}

std::optional<LoopCorrection> LoopCloser::correct() {
  const bool links_wait = links_replaced_ && !graph_.loops().empty();
  if (waiting_loops_ == 0 && !links_wait) return std::nullopt;
  waiting_loops_ = 0;
  links_replaced_ = false;
  return correction_to(graph_.optimize(settings_.pose_graph));
}

/// The correction that moves all keyframes to these poses, in ids of this run.
LoopCorrection LoopCloser::correction_to(const std::vector<LinkedPose>& poses) const {
  LoopCorrection correction;
  for (std::size_t id = 0; id < poses.size(); ++id) {
    if (ids_.is_loaded(id)) {
      correction.T_world_loaded_keyframe.push_back(poses[id].estimate.pose);
    } else {
      correction.T_world_keyframe.push_back(poses[id]);
    }
  }
  const MapSegments& segments = graph_.segments();
  for (std::size_t s = ids_.segments; s < segments.size(); ++s) {
    correction.segment_localised.push_back(segments.localised(s));
  }
  correction.identity = identity_;
  return correction;
}

}  // namespace stereo_slam
