// SPDX-License-Identifier: MIT
#include "stereo_slam/loop_closing/loop_closer.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "stereo_slam/core/pose_estimate.hpp"

namespace stereo_slam {
namespace {

/// The first loops of a revisit trigger an optimisation. After that, one is triggered by every kFewestLoops
/// loops, or by more in a large map, so that the computing time per kilometre does not grow with the map.
constexpr std::size_t kFewestLoops = 2;
constexpr std::size_t kKeyframesPerLoop = 500;

/// Covariance of an edge that keeps the graph connected without information on the pose.
[[nodiscard]] Matrix6<double> no_knowledge() {
  constexpr double kRotation_rad = 1.0;
  constexpr double kTranslation_m = 100.0;
  Vector6<double> variance;
  variance << Vector3<double>::Constant(kRotation_rad * kRotation_rad),
      Vector3<double>::Constant(kTranslation_m * kTranslation_m);
  return variance.asDiagonal();
}

[[nodiscard]] PoseGraphEdge edge_of(const LoopMeasurement& loop) {
  return {loop.old_keyframe, loop.new_keyframe, loop.T_old_new};
}

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

LoopCloser::LoopCloser(const StereoCamera& camera, const Settings& settings, const SavedMap& loaded,
                       MapUse use)
    : camera_(camera),
      settings_(settings),
      keyframes_(static_cast<std::size_t>(settings.loop_closure.max_points)),
      places_(settings.place_recognition),
      consistency_(settings.loop_verification) {
  if (!loaded.keyframes.empty()) start_with(loaded, use);
}

void LoopCloser::start_with(const SavedMap& loaded, MapUse use) {
  std::vector<PoseGaussian> poses;
  for (const auto& keyframe : loaded.keyframes) {
    const std::size_t id = add_keyframe(keyframe);
    places_.add(id, keyframes_[id].points);
    poses.push_back(keyframe.T_world_keyframe);
  }
  keyframes_.correct(poses);
  for (const auto& loop : loaded.loops) segments_.join(segment_of(loop.from), segment_of(loop.to));
  drop_guesses();
  loops_ = loaded.loops;
  loaded_ = extent_of(loaded);
  if (use == MapUse::kLocalise) fixed_keyframes_ = loaded_.keyframes;
}

/// Converts the ids of a keyframe of this run to those of the combined map, where the run follows the loaded
/// map. The pose of the run's first keyframe relative to the loaded map is unknown.
void LoopCloser::follow_loaded_map(Keyframe& keyframe) const {
  keyframe.frame += loaded_.frames;
  keyframe.segment += loaded_.segments;
  for (auto& point : keyframe.points) {
    if (point.landmark > 0) point.landmark += loaded_.landmarks;
  }
  if (loaded_.keyframes > 0 && keyframes_.size() == loaded_.keyframes) {
    keyframe.T_previous_keyframe = {keyframes_.back().T_world_keyframe.pose.inverse(), no_knowledge()};
  }
}

void LoopCloser::save(SavedMap& map) const {
  map.keyframes = keyframes_.all();
  map.loops = loops_;
  for (auto& keyframe : map.keyframes) {
    for (auto& point : keyframe.points) point.landmark = identity_(point.landmark);
  }
}

std::optional<LoopCorrection> LoopCloser::process(Keyframe keyframe) {
  follow_loaded_map(keyframe);
  const std::size_t id = add_keyframe(std::move(keyframe));
  const bool was_localised = segments_.localised(segment_of(id));
  std::vector<LoopMeasurement> confirmed;
  if (!follows_last_loop(keyframes_[id])) {
    confirmed = confirm(measure(keyframes_[id]));
    accept(confirmed);
  }
  places_.add(id, keyframes_[id].points);
  const bool newly_localised = !was_localised && segments_.localised(segment_of(id));
  const bool first_of_row = confirmed.size() > 1 && waiting_loops_ > 0;
  const std::size_t enough = std::max(kFewestLoops, keyframes_.size() / kKeyframesPerLoop);
  if (!newly_localised && !first_of_row && waiting_loops_ < enough) return std::nullopt;
  return correct();
}

void LoopCloser::replace(std::vector<KeyframeLink> links) {
  if (links.empty()) return;
  for (auto& link : links) {
    link.keyframe += loaded_.keyframes;
    odometry_[link.keyframe - 1].T_from_to = link.T_previous_keyframe;
  }
  keyframes_.replace(links);
  links_replaced_ = true;
  if (!loops_.empty()) return;
  std::vector<PoseGaussian> poses_before;
  for (std::size_t id = 0; id < links.front().keyframe; ++id) {
    poses_before.push_back(keyframes_[id].T_world_keyframe);
  }
  keyframes_.correct(poses_before);
}

std::optional<LoopCorrection> LoopCloser::correct() {
  if (waiting_loops_ == 0 && !(links_replaced_ && !loops_.empty())) return std::nullopt;
  waiting_loops_ = 0;
  links_replaced_ = false;
  PoseGraph graph = pose_graph();
  graph.poses = optimize(graph, settings_.pose_graph).poses;
  const auto poses = with_covariances(graph);
  std::vector<PoseGaussian> estimates;
  estimates.reserve(poses.size());
  for (const auto& pose : poses) estimates.push_back(pose.estimate);
  keyframes_.correct(estimates);
  LoopCorrection correction;
  const auto first = static_cast<std::ptrdiff_t>(loaded_.keyframes);
  correction.T_world_keyframe.assign(poses.begin() + first, poses.end());
  correction.T_world_loaded_keyframe.assign(graph.poses.begin(), graph.poses.begin() + first);
  for (std::size_t s = loaded_.segments; s < segments_.size(); ++s) {
    correction.segment_localised.push_back(segments_.localised(s));
  }
  correction.identity = identity_;
  return correction;
}

std::size_t LoopCloser::memory_bytes() const { return keyframes_.memory_bytes() + places_.memory_bytes(); }

std::size_t LoopCloser::add_keyframe(Keyframe keyframe) {
  const std::size_t id = keyframes_.add(std::move(keyframe));
  const Keyframe& added = keyframes_[id];
  if (added.segment >= segments_.size()) segments_.begin(id);
  if (id > 0) {
    odometry_.push_back({id - 1, id, added.T_previous_keyframe, added.frame - keyframes_[id - 1].frame});
  }
  return id;
}

/// Keyframes and constraints as a pose graph.
PoseGraph LoopCloser::pose_graph() const {
  PoseGraph graph{.poses = {},
                  .odometry = odometry_,
                  .loops = loops_,
                  .gauge = fixed_keyframes_,
                  .drift_sigma_rad = drift_sigma_rad(settings_.calibration.drift_px, camera_)};
  for (const auto& keyframe : keyframes_.all()) graph.poses.push_back(keyframe.T_world_keyframe.pose);
  return graph;
}

/// Whether a keyframe is so close behind the last loop that another loop would add little information.
bool LoopCloser::follows_last_loop(const Keyframe& keyframe) const {
  if (loops_.empty()) return false;
  const Keyframe& last = keyframes_[loops_.back().to];
  return last.segment == keyframe.segment &&
         keyframe.path_length_m - last.path_length_m < settings_.loop_closure.spacing_m;
}

/// Number of keyframes, from the first, that a loop may lead to: those that are old enough or, in a segment
/// whose place is not known, all before the segment.
std::size_t LoopCloser::comparable_keyframes(const Keyframe& keyframe) const {
  if (!segments_.localised(keyframe.segment)) return segments_.first_keyframe(keyframe.segment);
  const auto gap = static_cast<std::size_t>(settings_.place_recognition.min_gap_frames);
  std::size_t count = keyframe.id;
  while (count > 0 && keyframes_[count - 1].frame + gap > keyframe.frame) --count;
  return count;
}

/// The paper's trigger: the nearby keyframe with the largest share of points in view.
std::optional<std::size_t> LoopCloser::most_in_view(const Keyframe& keyframe, std::size_t end) const {
  const auto& rule = settings_.place_recognition;
  const Vector3<double> position = keyframe.T_world_keyframe.pose.translation();
  std::optional<std::size_t> best;
  double best_share = rule.min_share_in_view;
  for (std::size_t id = 0; id < end; ++id) {
    const Keyframe& old = keyframes_[id];
    if (!segments_.joined(old.segment, keyframe.segment)) continue;
    if ((old.T_world_keyframe.pose.translation() - position).norm() > rule.view_radius_m) continue;
    const double share = share_in_view(old, keyframe, camera_);
    if (share <= best_share) continue;
    best = id;
    best_share = share;
  }
  return best;
}

std::vector<std::size_t> LoopCloser::candidates(const Keyframe& keyframe) const {
  const std::size_t end = comparable_keyframes(keyframe);
  std::vector<std::size_t> result;
  for (const auto& place : places_.query(keyframe.points, end).candidates) result.push_back(place.keyframe);
  const auto in_view = most_in_view(keyframe, end);
  if (in_view && std::find(result.begin(), result.end(), *in_view) == result.end())
    result.push_back(*in_view);
  return result;
}

/// The loop with the most inliers among the candidates. A candidate that shares tracked landmarks with the
/// keyframe never went out of view and is no loop.
std::optional<LoopMeasurement> LoopCloser::measure(const Keyframe& keyframe) const {
  constexpr std::size_t kTrackedLandmarks = 10;
  std::optional<LoopMeasurement> best;
  for (const std::size_t candidate : candidates(keyframe)) {
    if (shared_landmarks(keyframes_[candidate], keyframe) >= kTrackedLandmarks) continue;
    const auto verified = verify_loop(keyframes_[candidate], keyframe, camera_, settings_.loop_verification,
                                      settings_.seed + keyframe.id);
    if (verified.check != LoopCheck::kVerified) continue;
    if (!best || verified.loop.inliers > best->inliers) best = verified.loop;
  }
  return best;
}

/// The loops that are certain by now: those that consecutive keyframes agree on. While the camera's place is
/// not known, one that finds it with many inliers is enough, because the camera waits for it.
std::vector<LoopMeasurement> LoopCloser::confirm(const std::optional<LoopMeasurement>& loop) {
  const auto& rule = settings_.loop_verification;
  const bool finds_place = loop && segments_.localised(segment_of(loop->old_keyframe)) &&
                           !segments_.localised(segment_of(loop->new_keyframe));
  if (!finds_place || loop->inliers < rule.relocalisation_inliers) return consistency_.add(loop, keyframes_);
  consistency_ = LoopConsistency(rule);
  return {*loop};
}

/// The gate: accepts loops that agree with the pose graph's prediction, whose covariance is increased by the
/// allowance for drift, and logs all.
void LoopCloser::accept(const std::vector<LoopMeasurement>& loops) {
  if (loops.empty()) return;
  const auto& rule = settings_.loop_verification;
  std::vector<PoseGraphEdge> edges;
  for (const auto& loop : loops) {
    const PoseGraphEdge& edge = edges.emplace_back(edge_of(loop));
    if (!segments_.joined(segment_of(edge.from), segment_of(edge.to))) join(edge);
  }
  const LoopPrediction prediction(pose_graph(), settings_.pose_graph);
  std::vector<PoseGraphEdge> accepted;
  for (std::size_t i = 0; i < loops.size(); ++i) {
    const PoseGraphEdge& edge = edges[i];
    const CovarianceInflation inflation{rule.gate_scale,
                                        gate_allowance(path_length_m(edge.from, edge.to), rule)};
    // Where nothing is predicted, every measurement is as likely as any other.
    const bool predicted = prediction.knows(edge.from, edge.to);
    const double chi2 = predicted ? prediction.mahalanobis_squared(edge, inflation) : 0.0;
    const bool agrees = chi2 <= rule.max_chi2;
    log(edge, loops[i].inliers, chi2, agrees);
    if (!agrees) continue;
    accepted.push_back(edge);
    for (const auto& [old_landmark, new_landmark] : loops[i].same_landmarks) {
      identity_.unite(old_landmark, new_landmark);
    }
  }
  loops_.insert(loops_.end(), accepted.begin(), accepted.end());
  waiting_loops_ += accepted.size();
}

/// Logs a loop with its squared Mahalanobis distance from the prediction.
void LoopCloser::log(const PoseGraphEdge& loop, int inliers, double chi2, bool accepted) {
  const bool in_loaded = loop.from < loaded_.keyframes;
  events_.push_back({.frame = keyframes_[loop.to].frame - loaded_.frames,
                     .old_frame = keyframes_[loop.from].frame - (in_loaded ? 0 : loaded_.frames),
                     .in_loaded_map = in_loaded,
                     .inliers = inliers,
                     .chi2 = chi2,
                     .accepted = accepted,
                     .T_old_new = loop.T_from_to.pose});
}

/// Length of the shortest path between two keyframes: along the trajectory, or over one loop.
double LoopCloser::path_length_m(std::size_t from, std::size_t to) const {
  const auto along = [&](std::size_t a, std::size_t b) {
    return std::abs(keyframes_[a].path_length_m - keyframes_[b].path_length_m);
  };
  double shortest = along(from, to);
  for (const auto& loop : loops_) {
    shortest = std::min(shortest, along(from, loop.from) + along(loop.to, to));
  }
  return shortest;
}

/// Joins two segments by their first loop. The later segment, and those joined with it, move so that they
/// satisfy the loop; segments after them whose place is a guess move along.
void LoopCloser::join(const PoseGraphEdge& loop) {
  const std::size_t from = segments_.root(segment_of(loop.from));
  const std::size_t to = segments_.root(segment_of(loop.to));
  const Pose T_world_from = keyframes_[loop.from].T_world_keyframe.pose;
  const Pose T_world_to = keyframes_[loop.to].T_world_keyframe.pose;
  const Pose motion = to > from ? T_world_from * loop.T_from_to.pose * T_world_to.inverse()
                                : T_world_to * loop.T_from_to.pose.inverse() * T_world_from.inverse();
  std::vector<std::optional<Pose>> motions;  // of each segment, if it moves
  for (std::size_t s = 0; s < segments_.size(); ++s) {
    const std::size_t root = segments_.root(s);
    if (root == std::max(from, to)) {
      motions.emplace_back(motion);
    } else if (root < s) {
      motions.push_back(motions[root]);
    } else {
      motions.push_back(s == 0 ? std::nullopt : motions[s - 1]);
    }
  }
  std::vector<PoseGaussian> poses;
  for (const auto& keyframe : keyframes_.all()) {
    poses.push_back(keyframe.T_world_keyframe);
    const auto& moved = motions[keyframe.segment];
    if (moved) poses.back().pose = (*moved * poses.back().pose).renormalized();
  }
  keyframes_.correct(poses);
  segments_.join(from, to);
  drop_guesses();
}

/// Replaces the guessed odometry edges between joined segments by edges with the present relative poses and
/// practically no information.
void LoopCloser::drop_guesses() {
  for (std::size_t s = 1; s < segments_.size(); ++s) {
    if (!segments_.joined(s - 1, s)) continue;
    auto& guess = odometry_[segments_.first_keyframe(s) - 1];
    const Pose& T_world_from = keyframes_[guess.from].T_world_keyframe.pose;
    const Pose& T_world_to = keyframes_[guess.to].T_world_keyframe.pose;
    guess.T_from_to = {(T_world_from.inverse() * T_world_to).renormalized(), no_knowledge()};
    guess.frames = 0;
  }
}

/// Poses of an optimised graph with their marginal covariances. If these cannot be computed, each covariance
/// is composed from that of the keyframe before and the odometry, without the information of the loops.
std::vector<DriftingPose> LoopCloser::with_covariances(const PoseGraph& graph) const {
  auto result = marginals(graph, settings_.pose_graph);
  const bool known = !result.empty();
  result.resize(graph.poses.size());
  for (std::size_t id = 0; id < result.size(); ++id) {
    if (id < graph.gauge) {
      result[id] = {{graph.poses[id], keyframes_[id].T_world_keyframe.covariance}};
    } else if (!known) {
      const Pose T_previous_keyframe = graph.poses[id - 1].inverse() * graph.poses[id];
      result[id] = compose(result[id - 1],
                           PoseGaussian{T_previous_keyframe, keyframes_[id].T_previous_keyframe.covariance},
                           static_cast<double>(odometry_[id - 1].frames));
      result[id].estimate.pose = graph.poses[id];
    }
  }
  return result;
}

}  // namespace stereo_slam
