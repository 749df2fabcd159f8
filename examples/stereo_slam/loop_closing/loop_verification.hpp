// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/loop_closing/keyframe.hpp"
#include "stereo_slam/settings/settings.hpp"

namespace stereo_slam {

/// Measured loop between two keyframes.
struct LoopMeasurement {
  std::size_t old_keyframe = 0;
  std::size_t new_keyframe = 0;
  PoseGaussian T_old_new;
  int inliers = 0;
  std::vector<std::pair<std::uint32_t, std::uint32_t>>
      same_landmarks{};  ///< ids in the old and in the new keyframe
};

/// Measures the pose of a keyframe relative to an old one (sec. IV-F); nothing if they do not show one place.
///
/// Descriptors that are each other's best match give a pose by perspective-three-point with RANSAC, from the
/// old keyframe's points and the new one's image (perspective_pose()). Guided matching then searches every
/// old point where that pose predicts it. From the pairs of (u, v, d) the robust two-view adjustment of the
/// odometry estimates the pose and its covariance. The same input gives the same bits.
[[nodiscard]] std::optional<LoopMeasurement> verify_loop(const Keyframe& old_keyframe,
                                                         const Keyframe& new_keyframe,
                                                         const StereoCamera& camera,
                                                         const LoopVerificationSettings& settings,
                                                         std::uint64_t seed);

/// Keyframes in a row whose loops must agree (sec. IV-F).
inline constexpr int kConsecutiveLoops = 3;

/// Accepts loops that consecutive keyframes agree on.
class LoopConsistency {
 public:
  explicit LoopConsistency(const LoopVerificationSettings& settings) : settings_(settings) {}

  /// Adds the loop measured at a keyframe, or that there is none. Once kConsecutiveLoops keyframes in a
  /// row agree, returns all loops of the row, then one by one. A row stays within one pair of segments: the
  /// pose between segments is a guess.
  [[nodiscard]] std::vector<LoopMeasurement> add(const std::optional<LoopMeasurement>& loop,
                                                 const std::vector<Keyframe>& keyframes);

 private:
  LoopVerificationSettings settings_;
  std::vector<LoopMeasurement> agreeing_;
};

/// Covariance that the gate on loops adds for systematic errors over a path of `length_m`, which the
/// covariances of the estimates do not contain. The path is stretched in proportion to its length. It is also
/// rotated in proportion to its length, which displaces its end.
[[nodiscard]] Matrix6<double> gate_allowance(double length_m);

}  // namespace stereo_slam
