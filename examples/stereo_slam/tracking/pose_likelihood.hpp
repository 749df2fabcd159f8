// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include <antipode/eigen_types.hpp>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/local_map/landmark.hpp"
#include "stereo_slam/local_map/match.hpp"
#include "stereo_slam/tracking/landmark_block.hpp"
#include "stereo_slam/tracking/whitened_matches.hpp"

namespace stereo_slam {

/// Log-likelihood of camera poses given matched landmarks, as in whitened_matches.hpp, with a cap on the
/// squared distance e_j' S_j^-1 e_j of each landmark. A landmark behind a sampled camera costs `cap`; w sums
/// over the landmarks below it. The object keeps no references to its arguments.
class PoseLikelihood {
 public:
  PoseLikelihood(const WhitenedMatches& matches, double cap);

  /// For landmarks whose errors are independent of the prior's.
  PoseLikelihood(std::span<const Match> matches, const MapView& map, double cap)
      : PoseLikelihood(whiten(matches, map), cap) {}

  /// For landmarks whose errors are correlated with the prior's.
  PoseLikelihood(std::span<const Match> matches, const MapView& map, double cap, const PoseGaussian& prior)
      : PoseLikelihood(whiten(matches, map, prior), cap) {}

  /// Batched over the columns [q; p] of `poses` (T_keyframe_camera).
  template <int Count>
  void operator()(const antipode::Matrix<double, 8, Count>& poses,
                  antipode::Vector<double, Count>& values) const {
    for (int k = 0; k < Count; ++k) values[k] = evaluate(poses.col(k));
  }

  /// Sum of the capped squared Mahalanobis distances at one pose.
  [[nodiscard]] double squared_distance(const Pose& T_keyframe_camera) const {
    return -2.0 * evaluate(T_keyframe_camera.coeffs());
  }

  /// Number of scalar measurements.
  [[nodiscard]] int dimension() const noexcept { return 3 * static_cast<int>(count_); }

 private:
  [[nodiscard]] double evaluate(const antipode::Vector8<double>& pose) const;

  StereoCamera camera_;
  double cap_;
  std::size_t count_;  // of landmarks
  std::vector<LandmarkBlock> blocks_;
  std::optional<SharedError> shared_;
};

}  // namespace stereo_slam
