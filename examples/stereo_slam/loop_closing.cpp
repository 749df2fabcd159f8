// SPDX-License-Identifier: MIT
#include "loop_closing.hpp"

#include <algorithm>
#include <cmath>
#include <future>
#include <utility>

#include "loop_verification.hpp"
#include "place_recognition.hpp"
#include "pose_graph.hpp"
#include "update.hpp"

namespace stereo_slam {
namespace {

/// Loops at consecutive keyframes say nearly the same: the first of a row is worth an optimisation, then
/// every so many.
constexpr std::size_t kLoopsPerOptimization = 5;

/// Keyframes whose marginal covariance is computed after an optimisation: it takes milliseconds for each.
constexpr std::size_t kMarginals = 64;

/// The work on keyframes, in their order.
class LoopSearch {
 public:
  LoopSearch(const StereoCamera& camera, const Settings& settings)
      : camera_(camera),
        settings_(settings),
        keyframes_(static_cast<std::size_t>(settings.loop_closure.max_points)),
        places_(settings.place_recognition),
        consistency_(settings.loop_verification) {}

  [[nodiscard]] std::optional<LoopCorrection> process(Keyframe keyframe) {
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

  /// Lets the loops take effect that wait for more.
  [[nodiscard]] std::optional<LoopCorrection> correct() {
    if (waiting_loops_ == 0) return std::nullopt;
    waiting_loops_ = 0;
    graph_.poses = optimize(graph_, settings_.pose_graph).poses;
    LoopCorrection correction{with_covariances(graph_.poses)};
    keyframes_.correct(correction.T_world_keyframe);
    return correction;
  }

  [[nodiscard]] const std::vector<LoopEvent>& events() const { return events_; }
  [[nodiscard]] std::size_t memory_bytes() const {
    return keyframes_.memory_bytes() + places_.memory_bytes();
  }

 private:
  void add_node(const Keyframe& keyframe) {
    graph_.poses.push_back(keyframe.T_world_keyframe.pose);
    if (keyframe.id > 0) {
      graph_.odometry.push_back({keyframe.id - 1, keyframe.id, keyframe.T_previous_keyframe});
    }
  }

  /// Poses with their covariances: marginal ones for some keyframes, for those between them composed from the
  /// one before, which makes them a little too large.
  [[nodiscard]] std::vector<PoseEstimate> with_covariances(const std::vector<Pose>& poses) const {
    const std::size_t stride = 1 + (poses.size() - 1) / kMarginals;
    std::vector<std::size_t> chosen;
    for (std::size_t id = 0; id < poses.size(); id += stride) chosen.push_back(id);
    if (chosen.back() + 1 < poses.size()) chosen.push_back(poses.size() - 1);
    const auto marginals = marginal_covariances(graph_, chosen, settings_.pose_graph);
    std::vector<PoseEstimate> result;
    for (std::size_t id = 0; id < poses.size(); ++id) {
      const auto at = std::lower_bound(chosen.begin(), chosen.end(), id);
      if (*at == id && !marginals.empty()) {
        result.push_back({poses[id], marginals[static_cast<std::size_t>(at - chosen.begin())]});
      } else if (id == 0) {
        result.push_back({poses[0], Matrix6<double>::Zero()});
      } else {
        const Pose T_previous_keyframe = poses[id - 1].inverse() * poses[id];
        result.push_back(
            compose(result.back(), {T_previous_keyframe, keyframes_[id].T_previous_keyframe.covariance}));
        result.back().pose = poses[id];
      }
    }
    return result;
  }

  /// How many keyframes, from the first, are old enough to be a place seen again.
  [[nodiscard]] std::size_t old_keyframes(const Keyframe& keyframe) const {
    const auto gap = static_cast<std::size_t>(settings_.place_recognition.min_gap_frames);
    std::size_t count = keyframe.id;
    while (count > 0 && keyframes_[count - 1].frame + gap > keyframe.frame) --count;
    return count;
  }

  /// The loop with the most inliers among the candidates.
  [[nodiscard]] std::optional<LoopMeasurement> measure(const Keyframe& keyframe) const {
    std::optional<LoopMeasurement> best;
    for (const auto& candidate : places_.query(keyframe.points, old_keyframes(keyframe)).candidates) {
      const auto verified = verify_loop(keyframes_[candidate.keyframe], keyframe, camera_,
                                        settings_.loop_verification, settings_.seed + keyframe.id);
      if (verified.check != LoopCheck::kVerified) continue;
      if (!best || verified.loop.inliers > best->inliers) best = verified.loop;
    }
    return best;
  }

  /// Shortest way between two keyframes along the drive, or over one loop: over it errors grow no further.
  [[nodiscard]] double way_m(std::size_t from, std::size_t to) const {
    const auto along = [&](std::size_t a, std::size_t b) {
      return std::abs(keyframes_[a].travelled_m - keyframes_[b].travelled_m);
    };
    double shortest = along(from, to);
    for (const auto& loop : graph_.loops) {
      shortest = std::min(shortest, along(from, loop.from) + along(loop.to, to));
    }
    return shortest;
  }

  /// The gate: loops that contradict the graph by far are logged and refused.
  void accept(const std::vector<LoopMeasurement>& loops) {
    const auto& rule = settings_.loop_verification;
    std::vector<PoseGraphEdge> accepted;
    for (const auto& loop : loops) {
      const PoseGraphEdge edge{loop.old_keyframe, loop.new_keyframe, loop.T_old_new};
      const double chi2 =
          innovation(graph_, edge, {rule.gate_scale, drift_allowance(way_m(edge.from, edge.to), rule)},
                     settings_.pose_graph);
      if (chi2 <= rule.max_chi2) accepted.push_back(edge);
      events_.push_back({keyframes_[loop.new_keyframe].frame, keyframes_[loop.old_keyframe].frame,
                         loop.inliers, chi2, chi2 <= rule.max_chi2});
    }
    graph_.loops.insert(graph_.loops.end(), accepted.begin(), accepted.end());
    waiting_loops_ += accepted.size();
  }

  StereoCamera camera_;
  Settings settings_;
  KeyframeDatabase keyframes_;
  PlaceRecognition places_;
  LoopConsistency consistency_;
  PoseGraph graph_;
  std::size_t waiting_loops_ = 0;  // in the graph, but not yet in its poses
  std::vector<LoopEvent> events_;
};

}  // namespace

struct LoopClosing::State {
  LoopSearch search;
  LoopThread thread;
  std::size_t latency_frames;
  std::future<std::optional<LoopCorrection>> running{};
  std::size_t running_due = 0;
  std::optional<LoopCorrection> ready{};
  std::size_t ready_due = 0;

  /// The search while nothing works on it.
  [[nodiscard]] const LoopSearch& at_rest() const {
    if (running.valid()) running.wait();
    return search;
  }

  /// Waits for the work at hand. Its correction contains any earlier one.
  void collect() {
    if (!running.valid()) return;
    auto correction = running.get();
    if (!correction) return;
    ready = std::move(correction);
    ready_due = running_due;
  }
};

LoopClosing::LoopClosing(const StereoCamera& camera, const Settings& settings, LoopThread thread)
    : state_(new State{.search = LoopSearch(camera, settings),
                       .thread = thread,
                       .latency_frames = static_cast<std::size_t>(settings.loop_closure.latency_frames)}) {}
LoopClosing::~LoopClosing() = default;
LoopClosing::LoopClosing(LoopClosing&&) noexcept = default;
LoopClosing& LoopClosing::operator=(LoopClosing&&) noexcept = default;

void LoopClosing::add_keyframe(Keyframe keyframe) {
  State& s = *state_;
  s.collect();
  s.running_due = keyframe.frame + s.latency_frames;
  const auto policy = s.thread == LoopThread::kOwn ? std::launch::async : std::launch::deferred;
  s.running = std::async(policy, [&search = s.search, keyframe = std::move(keyframe)]() mutable {
    return search.process(std::move(keyframe));
  });
}

std::optional<LoopCorrection> LoopClosing::correction_due(std::size_t frame) {
  State& s = *state_;
  if (s.running.valid() && frame >= s.running_due) s.collect();
  if (!s.ready || frame < s.ready_due) return std::nullopt;
  return std::exchange(s.ready, std::nullopt);
}

std::optional<LoopCorrection> LoopClosing::finish() {
  State& s = *state_;
  s.collect();
  if (auto last = s.search.correct()) s.ready = std::move(last);
  return std::exchange(s.ready, std::nullopt);
}

std::vector<LoopEvent> LoopClosing::events() const { return state_->at_rest().events(); }

std::size_t LoopClosing::memory_bytes() const { return state_->at_rest().memory_bytes(); }

}  // namespace stereo_slam
