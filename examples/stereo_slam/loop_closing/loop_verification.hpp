// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/keyframes/keyframe_database.hpp"
#include "stereo_slam/settings/settings.hpp"

namespace stereo_slam {

/// A keyframe seen from a later one.
struct LoopMeasurement {
  std::size_t old_keyframe = 0;
  std::size_t new_keyframe = 0;
  PoseGaussian T_old_new;
  int inliers = 0;
  std::vector<std::pair<std::uint32_t, std::uint32_t>>
      same_landmarks{};  ///< numbers in the old and the new one
};

/// How far the check of a candidate came.
enum class LoopCheck { kTooFewMatches, kNoPose, kTooFewInliers, kVerified };

[[nodiscard]] constexpr const char* to_string(LoopCheck check) noexcept {
  switch (check) {
    case LoopCheck::kTooFewMatches:
      return "too few matching descriptors";
    case LoopCheck::kNoPose:
      return "no common pose";
    case LoopCheck::kTooFewInliers:
      return "too few inliers";
    case LoopCheck::kVerified:
      return "verified";
  }
  return "unknown";
}

struct LoopVerification {
  LoopCheck check = LoopCheck::kTooFewMatches;
  int matches = 0;  ///< of descriptors
  LoopMeasurement loop;
};

/// Measures the pose of a keyframe relative to an old one (sec. IV-F).
///
/// Descriptors that are each other's best match give a pose by perspective-n-point with RANSAC, from the old
/// keyframe's points and the new one's image. With it every old point is predicted and looked for where it
/// should be. The pairs of (u, v, d) that result go into the robust two-view adjustment of the odometry,
/// which gives the pose and its covariance. The same input gives the same bits.
[[nodiscard]] LoopVerification verify_loop(const Keyframe& old_keyframe, const Keyframe& new_keyframe,
                                           const StereoCamera& camera,
                                           const LoopVerificationSettings& settings, std::uint64_t seed);

/// Whether consecutive keyframes tell of the same loop.
class LoopConsistency {
 public:
  explicit LoopConsistency(const LoopVerificationSettings& settings) : settings_(settings) {}

  /// Takes what was measured at a keyframe (nothing, if no loop was) and the keyframe's relative density to
  /// the one before. Returns the loops of the whole row once it is long enough: those of the row so far when
  /// it becomes so, then one by one. Rows do not reach across segments: what lies between them is a guess.
  [[nodiscard]] std::vector<LoopMeasurement> add(const std::optional<LoopMeasurement>& loop,
                                                 const KeyframeDatabase& keyframes);

 private:
  LoopVerificationSettings settings_;
  std::vector<LoopMeasurement> row_;
};

/// Squared Mahalanobis distance of two independent estimates of one pose, six degrees of freedom.
[[nodiscard]] double mahalanobis_squared(const PoseGaussian& a, const PoseGaussian& b);

/// Allowance for what the covariances do not know of, over a way of `length_m`: a stretch in proportion to
/// it, and a turn in proportion to it that swings the end about the middle.
[[nodiscard]] Matrix6<double> drift_allowance(double length_m, const LoopVerificationSettings& settings);

}  // namespace stereo_slam
