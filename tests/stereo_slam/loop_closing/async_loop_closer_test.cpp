// SPDX-License-Identifier: MIT
#include "stereo_slam/loop_closing/async_loop_closer.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>
#include <random>

#include <Eigen/Cholesky>

#include "stereo_slam/core/pose_estimate.hpp"
#include "stereo_slam/support/scenes.hpp"
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

constexpr unsigned kSeed = 9;
constexpr std::size_t kLap = 90;
constexpr std::size_t kKeyframes = 130;
constexpr std::size_t kFramesApart = 10;
constexpr double kRadius_m = 30.0;
constexpr double kLateral_m = 12.0;
constexpr std::size_t kPoints = 250;
constexpr std::uint32_t kCornersPerKeyframe = 60;
constexpr std::uint32_t kCorners = kCornersPerKeyframe * kLap;
constexpr std::size_t kTrackLost = 60;  // keyframe from which corners have new landmark ids

struct Corner {
  Vector3<double> position;
  Descriptor descriptor;
};

/// Corners on both sides of a circular street, and a drive around it, almost one and a half times.
class SquareTown {
 public:
  SquareTown() {
    Vector6<double> xi;
    xi << 0.0, 2.0 * std::numbers::pi / kLap, 0.0, 0.0, 0.0, 2.0 * std::numbers::pi * kRadius_m / kLap;
    for (std::size_t k = 0; k < kKeyframes; ++k) {
      truth_.push_back(k == 0 ? Pose() : (truth_.back() * Pose::exp(xi)).renormalized());
    }
    std::uniform_real_distribution<double> side(-kLateral_m, kLateral_m);
    std::uniform_real_distribution<double> height(-4.0, 1.6);
    std::uniform_real_distribution<double> ahead(0.0, 2.0);
    for (std::size_t k = 0; k < kLap; ++k) {
      for (std::uint32_t i = 0; i < kCornersPerKeyframe; ++i) {
        const double x = side(random_);
        const Vector3<double> p(x + std::copysign(3.0, x), height(random_), ahead(random_));
        corners_.push_back({truth_[k] * p, any_descriptor()});
      }
    }
  }

  [[nodiscard]] const std::vector<Pose>& truth() const { return truth_; }

  /// What keyframe `k` sees from the pose of keyframe `from`, with noise of its own.
  [[nodiscard]] std::vector<KeyframePoint> view(std::size_t k, std::size_t from) {
    random_.seed(kSeed + 1000 + k);
    const Pose& T_world_camera = truth_[from];
    std::vector<KeyframePoint> points;
    std::uint32_t landmark = k < kTrackLost ? 0 : kCorners;
    for (const auto& corner : corners_) {
      ++landmark;
      const Vector3<double> p = T_world_camera.inverse() * corner.position;
      if (p.z() < 4.0 || p.z() > 35.0) continue;
      const auto z = camera_.project(p);
      if (!z || !camera_.in_view(*z, 3.0)) continue;  // with noise, too
      points.push_back(
          {(*z + test::stereo_noise(random_, 0.5)).cast<float>(), worn(corner.descriptor), landmark});
    }
    std::shuffle(points.begin(), points.end(), random_);
    if (points.size() > kPoints) points.resize(kPoints);
    return points;
  }

  /// Relative pose as the filter estimates it, with errors of its covariance.
  [[nodiscard]] PoseGaussian odometry(std::size_t k) {
    std::normal_distribution<double> normal;
    Vector6<double> sigma;
    sigma << 0.003, 0.006, 0.003, 0.01, 0.01, 0.02;
    const Vector6<double> e = Vector6<double>::NullaryExpr([&] { return normal(odometry_random_); });
    return {(truth_[k - 1].inverse() * truth_[k]).boxplus(sigma.cwiseProduct(e)),
            sigma.cwiseAbs2().asDiagonal()};
  }

 private:
  [[nodiscard]] Descriptor any_descriptor() {
    Descriptor descriptor{};
    for (auto& byte : descriptor) byte = static_cast<std::uint8_t>(random_());
    return descriptor;
  }
  [[nodiscard]] Descriptor worn(Descriptor descriptor) {
    for (int flip = 0; flip < 16; ++flip) {
      auto& byte = descriptor[random_() % 32];
      byte = static_cast<std::uint8_t>(byte ^ (1U << (random_() % 8)));
    }
    return descriptor;
  }

  std::mt19937_64 random_{kSeed};
  std::mt19937_64 odometry_random_{kSeed + 1};  // the same errors whatever is seen
  StereoCamera camera_ = test::kitti_camera();
  std::vector<Pose> truth_;
  std::vector<Corner> corners_;
};

struct Outcome {
  std::vector<PoseGaussian> open;    ///< T_world_keyframe from odometry alone
  std::vector<PoseGaussian> closed;  ///< with the corrections
  std::vector<std::size_t> corrected_at;
  std::vector<LoopEvent> events;
  std::vector<bool> segment_localised;  ///< after the last correction
  LandmarkIdentity identity;            ///< after the last correction
  SavedMap map;
};

/// Keyframe from whose pose keyframe k is rendered: its own, another to deceive, or none to see nothing.
using Eyes = std::function<std::optional<std::size_t>(std::size_t)>;
std::optional<std::size_t> own(std::size_t k) { return k; }

/// Map that a drive starts with, and where its tracking is lost.
struct Circumstances {
  SavedMap loaded{};
  MapUse use = MapUse::kContinue;
  std::size_t lost_before = kKeyframes;  ///< keyframe that begins the second segment
  std::size_t keyframes = kKeyframes;
  std::vector<KeyframeLink> remeasured{};  // at the end
  double spacing_baselines = 0.0;          // of the loops
  int relocalisation_inliers = LoopVerificationSettings{}.relocalisation_inliers;
};

Outcome drive(LoopThread thread, const Eyes& eyes = own, const Circumstances& circumstances = {}) {
  Settings settings;
  settings.place_recognition.min_gap_frames = 30 * kFramesApart;
  settings.loop_closure.spacing_baselines = circumstances.spacing_baselines;
  settings.loop_verification.relocalisation_inliers = circumstances.relocalisation_inliers;
  SquareTown town;
  Outcome outcome;
  AsyncLoopCloser loops(test::kitti_camera(), settings, thread, circumstances.loaded, circumstances.use);
  std::vector<PoseGaussian> steps;
  const auto apply = [&](const std::optional<LoopCorrection>& correction) {
    if (!correction) return;
    outcome.segment_localised = correction->segment_localised;
    outcome.identity = correction->identity;
    auto& poses = outcome.closed;
    for (std::size_t k = 0; k < poses.size(); ++k) {
      poses[k] = k < correction->T_world_keyframe.size() ? correction->T_world_keyframe[k].estimate
                                                         : compose_first_order(poses[k - 1], steps[k]);
    }
  };
  for (std::size_t frame = 0; frame < circumstances.keyframes * kFramesApart; ++frame) {
    const auto correction = loops.correction_due(frame);
    if (correction) outcome.corrected_at.push_back(frame);
    apply(correction);
    if (frame % kFramesApart != 0) continue;
    const std::size_t k = frame / kFramesApart;
    Keyframe keyframe;
    keyframe.frame = frame;
    keyframe.segment = k < circumstances.lost_before ? 0 : 1;
    if (const auto from = eyes(k)) keyframe.points = town.view(k, *from);
    if (k > 0) keyframe.T_previous_keyframe = town.odometry(k);
    steps.push_back(keyframe.T_previous_keyframe);
    outcome.open.push_back(k == 0 ? PoseGaussian{} : compose_first_order(outcome.open.back(), steps.back()));
    outcome.closed.push_back(k == 0 ? PoseGaussian{}
                                    : compose_first_order(outcome.closed.back(), steps.back()));
    const bool lost = keyframe.segment > 0 && outcome.segment_localised.size() < 2;
    loops.add_keyframe(std::move(keyframe), {}, {}, lost ? CorrectionDelay::kShort : CorrectionDelay::kUsual);
  }
  apply(loops.finish(circumstances.remeasured));
  outcome.events = loops.events();
  outcome.map.camera = test::kitti_camera();
  loops.save(outcome.map);
  CHECK(loops.memory_bytes() < kKeyframes * kPoints * 150);
  return outcome;
}

double ate_m(const std::vector<PoseGaussian>& poses) {
  static const std::vector<Pose> truth = SquareTown().truth();
  double sum = 0.0;
  for (std::size_t k = 0; k < poses.size(); ++k) {
    sum += (poses[k].pose.translation() - truth[k].translation()).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(poses.size()));
}

std::ptrdiff_t count_accepted(const Outcome& outcome) {
  return std::count_if(outcome.events.begin(), outcome.events.end(),
                       [](const LoopEvent& e) { return e.accepted; });
}

const Outcome& undeceived_drive() {
  static const Outcome outcome = drive(LoopThread::kNone);
  return outcome;
}

TEST_CASE("A second lap closes loops at its keyframes, and they remove the drift", "[stereo_slam][loops]") {
  CAPTURE(kSeed);
  const Outcome& outcome = undeceived_drive();
  CHECK(count_accepted(outcome) >= static_cast<std::ptrdiff_t>(0.9 * (kKeyframes - kLap)));
  for (const auto& event : outcome.events) {
    CAPTURE(event.frame, event.old_frame, event.chi2);
    CHECK(event.accepted);
    CHECK(std::abs(static_cast<double>(event.frame) -
                   static_cast<double>(event.old_frame + kLap * kFramesApart)) <= 12.0 * kFramesApart);
  }
  CHECK(3.0 * ate_m(outcome.closed) < ate_m(outcome.open));
  CHECK(outcome.closed.back().covariance.trace() < outcome.open.back().covariance.trace());
}

TEST_CASE("Loops of one revisit keep their distance, and remove the drift all the same",
          "[stereo_slam][loops]") {
  CAPTURE(kSeed);
  const double baselines = LoopClosureSettings{}.spacing_baselines;
  const double spacing_m = baselines * test::kitti_camera().baseline_m;
  const Outcome spaced = drive(LoopThread::kNone, own, {.spacing_baselines = baselines});
  const auto& loops = spaced.map.loops;
  const auto& keyframes = spaced.map.keyframes;
  const auto first_row = static_cast<std::size_t>(kConsecutiveLoops);
  REQUIRE(loops.size() > first_row);
  for (std::size_t i = first_row; i < loops.size(); ++i) {
    const double path_m = keyframes[loops[i].to].path_length_m - keyframes[loops[i - 1].to].path_length_m;
    CHECK(path_m >= spacing_m);
    CHECK(path_m < 2.0 * spacing_m);
  }
  CHECK(3 * loops.size() < undeceived_drive().map.loops.size());
  CHECK(ate_m(spaced.closed) < 1.5 * ate_m(undeceived_drive().closed));
}

TEST_CASE("Corrections unite the landmarks that loops re-observe, and no others", "[stereo_slam][loops]") {
  const Outcome& outcome = undeceived_drive();
  int united = 0;
  for (std::uint32_t id = 1; id <= kCorners; ++id) {
    CHECK(outcome.identity(id) == id);
    const std::uint32_t second = outcome.identity(id + kCorners);
    if (second != id + kCorners) CHECK(second == id);
    united += second == id ? 1 : 0;
  }
  CHECK(united >= LoopVerificationSettings{}.min_inliers);
}

TEST_CASE("Keyframes whose motion is known better at the end move, with loops and without",
          "[stereo_slam][loops]") {
  const bool with_loops = GENERATE(false, true);
  CAPTURE(with_loops);
  const auto eyes = [&](std::size_t k) { return with_loops ? std::optional(k) : std::nullopt; };
  const Outcome before = drive(LoopThread::kNone, eyes);
  Circumstances circumstances;
  constexpr std::size_t kChanged = 20;
  const Keyframe& changed = before.map.keyframes[kChanged];
  Vector6<double> half_a_metre = Vector6<double>::Zero();
  half_a_metre[5] = 0.5;
  const PoseGaussian link{changed.T_previous_keyframe.pose.boxplus(half_a_metre).renormalized(),
                          changed.T_previous_keyframe.covariance};
  circumstances.remeasured = {{kChanged, link}};
  const Outcome after = drive(LoopThread::kOwn, eyes, circumstances);
  const auto& keyframes = after.map.keyframes;
  CHECK(keyframes[kChanged].T_previous_keyframe.pose.coeffs() == link.pose.coeffs());
  const auto moved_m = [&](std::size_t k) {
    return (keyframes[k].T_world_keyframe.pose.translation() -
            before.map.keyframes[k].T_world_keyframe.pose.translation())
        .norm();
  };
  CHECK(moved_m(kChanged - 1) < (with_loops ? 0.3 : 1e-12));
  CHECK(moved_m(kChanged) > (with_loops ? 0.05 : 0.49));
  // Without loops the rest of the path moves as a whole; loops hold it where it was.
  CHECK(moved_m(kKeyframes - 1) > (with_loops ? 0.0 : 0.49));
  if (with_loops) CHECK(moved_m(kKeyframes - 1) < 0.3);
}

TEST_CASE("Corrections take effect at the same frames, with the same bits, with and without a thread",
          "[stereo_slam][loops]") {
  const Outcome& first = undeceived_drive();
  const Outcome second = drive(LoopThread::kOwn);
  CHECK(first.corrected_at == second.corrected_at);
  REQUIRE_FALSE(first.corrected_at.empty());
  // One frame more than usual for each fifty keyframes.
  bool is_due = false;
  for (std::size_t k = 0; k < kKeyframes; ++k) {
    const auto latency = kCorrectionLatency_frames + k / 50;
    is_due = is_due || first.corrected_at.front() == k * kFramesApart + latency;
  }
  CHECK(is_due);
  REQUIRE(first.closed.size() == second.closed.size());
  for (std::size_t k = 0; k < first.closed.size(); ++k) {
    CHECK(first.closed[k].pose.coeffs() == second.closed[k].pose.coeffs());
    CHECK(first.closed[k].covariance == second.closed[k].covariance);
  }
}

TEST_CASE("A street that looks like another 20 m away is refused and changes nothing",
          "[stereo_slam][loops]") {
  CAPTURE(kSeed);
  constexpr std::size_t kBehind = 10;  // keyframes: 21 m
  const bool alone = GENERATE(true, false);
  CAPTURE(alone);
  // Before true loops have reduced the predicted covariance, and after.
  const std::size_t begin = alone ? kLap - 4 : kLap + 20;
  const auto deceived = [&](std::size_t k) { return k >= begin && k < begin + 6; };
  const Outcome outcome = drive(
      LoopThread::kNone, [&](std::size_t k) { return deceived(k) ? k - kBehind - (alone ? 40 : 0) : k; });
  const Outcome blind = drive(LoopThread::kNone, [&](std::size_t k) -> std::optional<std::size_t> {
    return deceived(k) ? std::nullopt : std::optional(k);
  });
  const auto refused = std::count_if(outcome.events.begin(), outcome.events.end(),
                                     [](const LoopEvent& e) { return !e.accepted; });
  CHECK(refused >= 3);
  for (const auto& event : outcome.events) {
    const std::size_t k = event.frame / kFramesApart;
    const std::size_t old = event.old_frame / kFramesApart;
    CAPTURE(k, old, event.chi2);
    // A deceived keyframe stores a false view of its place, which later keyframes may find.
    CHECK(event.accepted == !(deceived(k) || deceived(old)));
  }
  CHECK(ate_m(outcome.closed) == Approx(ate_m(blind.closed)).epsilon(0.1));
}

/// Farthest that the poses of keyframes are from the true poses of those from whose places they see.
double worst_error_m(const std::vector<PoseGaussian>& poses, const Eyes& eyes) {
  static const std::vector<Pose> truth = SquareTown().truth();
  double worst = 0.0;
  for (std::size_t k = 0; k < poses.size(); ++k) {
    worst = std::max(worst, (poses[k].pose.translation() - truth[*eyes(k)].translation()).norm());
  }
  return worst;
}

TEST_CASE("A segment that begins at an earlier place moves there as a whole", "[stereo_slam][loops]") {
  CAPTURE(kSeed);
  constexpr std::size_t kCut = 60;
  const Eyes carried_back = [](std::size_t k) { return k < kCut ? k : k - 50; };
  const bool single = GENERATE(true, false);
  Circumstances circumstances{.lost_before = kCut, .keyframes = 100};
  if (!single) circumstances.relocalisation_inliers = 1000;
  const Outcome outcome = drive(LoopThread::kNone, carried_back, circumstances);
  CHECK(outcome.segment_localised == std::vector<bool>{true, true});
  // By its first keyframe if that has inliers enough, else by three; each takes effect three frames later.
  REQUIRE_FALSE(outcome.corrected_at.empty());
  CHECK(outcome.corrected_at.front() == (kCut + (single ? 0 : 2)) * kFramesApart + 3);
  CHECK(worst_error_m(outcome.open, carried_back) > 20.0);
  CHECK(worst_error_m(outcome.closed, carried_back) < 1.5);
  // The guess is gone: the place is as certain as the loops make it.
  CHECK(outcome.closed[kCut].covariance.trace() < 1.0);
  for (const auto& event : outcome.events) {
    CAPTURE(event.frame, event.old_frame, event.chi2);
    CHECK(event.accepted);
  }
}

TEST_CASE("A segment without loops keeps its guessed pose", "[stereo_slam][loops]") {
  constexpr std::size_t kCut = 40;
  const Eyes blinded = [](std::size_t k) { return k < kCut ? std::optional(k) : std::nullopt; };
  const Outcome outcome = drive(LoopThread::kNone, blinded, {.lost_before = kCut, .keyframes = 80});
  CHECK(outcome.events.empty());
  for (std::size_t k = 0; k < outcome.closed.size(); ++k) {
    CHECK(outcome.closed[k].pose.coeffs() == outcome.open[k].pose.coeffs());
  }
}

TEST_CASE("A drive is localised in the map of another", "[stereo_slam][loops]") {
  CAPTURE(kSeed);
  const auto use = GENERATE(MapUse::kLocalise, MapUse::kContinue);
  const Outcome mapping = drive(LoopThread::kNone, own, {.keyframes = 70});
  CHECK_NOTHROW(check(mapping.map));
  const Eyes ahead = [](std::size_t k) { return k + 25; };
  const Outcome outcome =
      drive(LoopThread::kNone, ahead, {.loaded = mapping.map, .use = use, .keyframes = 30});
  CHECK(outcome.segment_localised == std::vector<bool>{true});
  CHECK(count_accepted(outcome) > 15);
  for (const auto& event : outcome.events) {
    CAPTURE(event.frame, event.old_frame);
    CHECK(event.in_loaded_map);
    CHECK(std::abs(static_cast<double>(event.old_frame) - static_cast<double>(event.frame) -
                   25.0 * kFramesApart) <= 12.0 * kFramesApart);
  }
  // As good as the map is, whose drift was not corrected.
  const Eyes mapped = own;
  CHECK(worst_error_m(outcome.closed, ahead) < 2.0 * worst_error_m(mapping.closed, mapped));
  REQUIRE(outcome.map.keyframes.size() == mapping.map.keyframes.size() + 30);
  for (std::size_t id = 0; id < mapping.map.keyframes.size(); ++id) {
    const bool same = outcome.map.keyframes[id].T_world_keyframe.pose.coeffs() ==
                      mapping.map.keyframes[id].T_world_keyframe.pose.coeffs();
    if (use == MapUse::kLocalise) CHECK(same);
  }
  CHECK_NOTHROW(check(outcome.map));
}

TEST_CASE("Keyframes share the landmarks that both observe", "[stereo_slam][loops]") {
  Keyframe a;
  Keyframe b;
  for (const std::uint32_t id : {5U, 0U, 3U, 9U}) a.points.push_back({{}, {}, id});
  for (const std::uint32_t id : {9U, 4U, 5U, 0U, 0U}) b.points.push_back({{}, {}, id});
  CHECK(shared_landmarks(a, b) == 2);
  CHECK(shared_landmarks(a, Keyframe{}) == 0);
}

}  // namespace
}  // namespace stereo_slam
