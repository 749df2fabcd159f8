// SPDX-License-Identifier: MIT
#include "stereo_slam/loop_closing/loop_closer.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "stereo_slam/core/pose_estimate.hpp"

namespace stereo_slam {
namespace {

/// Loops at consecutive keyframes say nearly the same: the first of a row is worth an optimisation, then
/// every so many.
constexpr std::size_t kLoopsPerOptimization = 5;

/// Keyframes whose marginal covariance is computed after an optimisation: it takes milliseconds for each.
constexpr std::size_t kMarginals = 64;

/// Of an edge that holds the graph together and says nothing.
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

/// Share of the points of one keyframe that are in the image of another, by their poses.
[[nodiscard]] double share_in_view(const Keyframe& seen, const Keyframe& from, const StereoCamera& camera) {
  const Pose T_from_seen = from.T_world_keyframe.pose.inverse() * seen.T_world_keyframe.pose;
  std::size_t count = 0;
  for (const auto& point : seen.points) {
    const auto z = camera.project(T_from_seen * camera.back_project(measurement(point)));
    if (z && camera.in_view(*z)) ++count;
  }
  return static_cast<double>(count) / static_cast<double>(std::max<std::size_t>(seen.points.size(), 1));
}

}  // namespace

LoopCloser::LoopCloser(const StereoCamera& camera, const Settings& settings, const SavedMap& known,
                       MapUse use)
    : camera_(camera),
      settings_(settings),
      keyframes_(static_cast<std::size_t>(settings.loop_closure.max_points)),
      places_(settings.place_recognition),
      consistency_(settings.loop_verification) {
  if (!known.keyframes.empty()) start_with(known, use);
}

void LoopCloser::start_with(const SavedMap& known, MapUse use) {
  std::vector<PoseGaussian> poses;
  for (const auto& keyframe : known.keyframes) {
    const std::size_t id = keyframes_.add(keyframe);
    add_node(keyframes_[id]);
    places_.add(id, keyframes_[id].points);
    poses.push_back(keyframe.T_world_keyframe);
    graph_.poses.back() = keyframe.T_world_keyframe.pose;
  }
  keyframes_.correct(poses);
  for (const auto& loop : known.loops) segments_.join(segment_of(loop.from), segment_of(loop.to));
  drop_guesses();
  graph_.loops = known.loops;
  known_ = extent_of(known);
  if (use == MapUse::kLocalise) graph_.gauge = known_.keyframes;
}

/// Makes a keyframe of this run one after those of the known map, the first one anywhere.
void LoopCloser::follow_known_map(Keyframe& keyframe) const {
  keyframe.frame += known_.frames;
  keyframe.segment += known_.segments;
  for (auto& point : keyframe.points) {
    if (point.landmark > 0) point.landmark += known_.landmarks;
  }
  if (known_.keyframes > 0 && keyframes_.size() == known_.keyframes) {
    keyframe.T_previous_keyframe = {keyframes_.back().T_world_keyframe.pose.inverse(), no_knowledge()};
  }
}

void LoopCloser::save(SavedMap& map) const {
  map.keyframes = keyframes_.all();
  map.loops = graph_.loops;
  for (auto& keyframe : map.keyframes) {
    for (auto& point : keyframe.points) point.landmark = identity_(point.landmark);
  }
}

std::optional<LoopCorrection> LoopCloser::process(Keyframe keyframe) {
  follow_known_map(keyframe);
  const std::size_t id = keyframes_.add(std::move(keyframe));
  add_node(keyframes_[id]);
  const auto measured = measure(keyframes_[id]);
  places_.add(id, keyframes_[id].points);
  const auto confirmed = consistency_.add(measured, keyframes_);
  accept(confirmed);
  const bool first_of_row = confirmed.size() > 1 && waiting_loops_ > 0;
  if (!first_of_row && waiting_loops_ < kLoopsPerOptimization) return std::nullopt;
  return correct();
}

std::optional<LoopCorrection> LoopCloser::correct() {
  if (waiting_loops_ == 0) return std::nullopt;
  waiting_loops_ = 0;
  graph_.poses = optimize(graph_, settings_.pose_graph).poses;
  const auto poses = with_covariances(graph_.poses);
  keyframes_.correct(poses);
  LoopCorrection correction;
  const auto first = static_cast<std::ptrdiff_t>(known_.keyframes);
  correction.T_world_keyframe.assign(poses.begin() + first, poses.end());
  correction.T_world_known_keyframe.assign(graph_.poses.begin(), graph_.poses.begin() + first);
  for (std::size_t s = known_.segments; s < segments_.size(); ++s) {
    correction.segment_placed.push_back(segments_.placed(s));
  }
  correction.identity = identity_;
  return correction;
}

std::size_t LoopCloser::memory_bytes() const { return keyframes_.memory_bytes() + places_.memory_bytes(); }

void LoopCloser::add_node(const Keyframe& keyframe) {
  graph_.poses.push_back(keyframe.T_world_keyframe.pose);
  if (keyframe.segment >= segments_.size()) segments_.begin(keyframe.id);
  if (keyframe.id > 0)
    graph_.odometry.push_back({keyframe.id - 1, keyframe.id, keyframe.T_previous_keyframe});
}

/// How many keyframes, from the first, may be a place seen again: those that are old enough, and in a segment
/// whose place is not known all before it.
std::size_t LoopCloser::comparable_keyframes(const Keyframe& keyframe) const {
  if (!segments_.placed(keyframe.segment)) return segments_.first_keyframe(keyframe.segment);
  const auto gap = static_cast<std::size_t>(settings_.place_recognition.min_gap_frames);
  std::size_t count = keyframe.id;
  while (count > 0 && keyframes_[count - 1].frame + gap > keyframe.frame) --count;
  return count;
}

/// The paper's trigger: of the keyframes near by, the one whose landmarks should be in view again, most of
/// them.
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

/// The loop with the most inliers among the candidates. What was never out of sight is no place seen again.
std::optional<LoopMeasurement> LoopCloser::measure(const Keyframe& keyframe) const {
  constexpr std::size_t kFollowed = 10;
  std::optional<LoopMeasurement> best;
  for (const std::size_t candidate : candidates(keyframe)) {
    if (shared_landmarks(keyframes_[candidate], keyframe) >= kFollowed) continue;
    const auto verified = verify_loop(keyframes_[candidate], keyframe, camera_, settings_.loop_verification,
                                      settings_.seed + keyframe.id);
    if (verified.check != LoopCheck::kVerified) continue;
    if (!best || verified.loop.inliers > best->inliers) best = verified.loop;
  }
  return best;
}

/// The gate: loops that contradict the graph by far are logged and refused.
void LoopCloser::accept(const std::vector<LoopMeasurement>& loops) {
  std::vector<PoseGraphEdge> accepted;
  for (const auto& loop : loops) {
    const PoseGraphEdge edge = edge_of(loop);
    if (!segments_.joined(segment_of(edge.from), segment_of(edge.to))) join(edge);
    const double chi2 = contradiction(edge);
    const bool good = chi2 <= settings_.loop_verification.max_chi2;
    if (good) {
      accepted.push_back(edge);
      for (const auto& [old_landmark, new_landmark] : loop.same_landmarks) {
        identity_.unite(old_landmark, new_landmark);
      }
    }
    const bool in_known = edge.from < known_.keyframes;
    events_.push_back({.frame = keyframes_[edge.to].frame - known_.frames,
                       .old_frame = keyframes_[edge.from].frame - (in_known ? 0 : known_.frames),
                       .in_loaded_map = in_known,
                       .inliers = loop.inliers,
                       .chi2 = chi2,
                       .accepted = good,
                       .T_old_new = edge.T_from_to.pose});
  }
  graph_.loops.insert(graph_.loops.end(), accepted.begin(), accepted.end());
  waiting_loops_ += accepted.size();
}

/// Squared Mahalanobis distance of a loop from what the graph predicts, with the allowance for what that does
/// not know of.
double LoopCloser::contradiction(const PoseGraphEdge& edge) const {
  const auto& rule = settings_.loop_verification;
  return mahalanobis_squared(graph_, edge, {rule.gate_scale, drift_allowance(way_m(edge.from, edge.to), rule)},
                    settings_.pose_graph);
}

/// Shortest way between two keyframes along the drive, or over one loop: over it errors grow no further.
double LoopCloser::way_m(std::size_t from, std::size_t to) const {
  const auto along = [&](std::size_t a, std::size_t b) {
    return std::abs(keyframes_[a].travelled_m - keyframes_[b].travelled_m);
  };
  double shortest = along(from, to);
  for (const auto& loop : graph_.loops) {
    shortest = std::min(shortest, along(from, loop.from) + along(loop.to, to));
  }
  return shortest;
}

/// Moves the segments that hang together with the later end of the loop so that it is met, and those after
/// them whose place is a guess from theirs.
void LoopCloser::join(const PoseGraphEdge& loop) {
  const std::size_t from = segments_.root(segment_of(loop.from));
  const std::size_t to = segments_.root(segment_of(loop.to));
  const Pose T_world_from = graph_.poses[loop.from];
  const Pose T_world_to = graph_.poses[loop.to];
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
  for (std::size_t id = 0; id < graph_.poses.size(); ++id) {
    const auto& moved = motions[segment_of(id)];
    if (moved) graph_.poses[id] = (*moved * graph_.poses[id]).renormalized();
  }
  segments_.join(from, to);
  drop_guesses();
}

/// Of how segments lie that loops have joined.
void LoopCloser::drop_guesses() {
  for (std::size_t s = 1; s < segments_.size(); ++s) {
    if (!segments_.joined(s - 1, s)) continue;
    auto& guess = graph_.odometry[segments_.first_keyframe(s) - 1];
    guess.T_from_to = {(graph_.poses[guess.from].inverse() * graph_.poses[guess.to]).renormalized(),
                       no_knowledge()};
  }
}

/// Keyframes beyond the gauge, in order, whose covariance is computed: the ends, the beginnings of segments,
/// and some between.
std::vector<std::size_t> LoopCloser::marginal_nodes() const {
  const std::size_t end = graph_.poses.size();
  const std::size_t stride = 1 + (end - graph_.gauge) / kMarginals;
  std::vector<std::size_t> nodes;
  for (std::size_t id = graph_.gauge; id < end; id += stride) nodes.push_back(id);
  for (std::size_t s = 0; s < segments_.size(); ++s) {
    if (segments_.first_keyframe(s) >= graph_.gauge) nodes.push_back(segments_.first_keyframe(s));
  }
  nodes.push_back(end - 1);
  std::sort(nodes.begin(), nodes.end());
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  return nodes;
}

/// Poses with their covariances: marginal ones for some keyframes, for those between them composed from the
/// one before, which makes them a little too large.
std::vector<PoseGaussian> LoopCloser::with_covariances(const std::vector<Pose>& poses) const {
  const auto nodes = marginal_nodes();
  const auto marginals = marginal_covariances(graph_, nodes, settings_.pose_graph);
  std::vector<PoseGaussian> result;
  for (std::size_t id = 0; id < graph_.gauge; ++id) {
    result.push_back({poses[id], keyframes_[id].T_world_keyframe.covariance});
  }
  for (std::size_t id = graph_.gauge; id < poses.size(); ++id) {
    const auto at = std::lower_bound(nodes.begin(), nodes.end(), id);
    if (*at == id && !marginals.empty()) {
      result.push_back({poses[id], marginals[static_cast<std::size_t>(at - nodes.begin())]});
    } else {
      const Pose T_previous_keyframe = poses[id - 1].inverse() * poses[id];
      result.push_back(
          compose(result.back(), {T_previous_keyframe, keyframes_[id].T_previous_keyframe.covariance}));
      result.back().pose = poses[id];
    }
  }
  return result;
}

}  // namespace stereo_slam
