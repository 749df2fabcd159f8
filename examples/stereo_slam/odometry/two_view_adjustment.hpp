// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// The same point measured in two stereo frames.
struct StereoCorrespondence {
  StereoPoint previous;
  StereoPoint current;
  std::optional<Matrix3<double>> R = {};  ///< covariance of each measurement, px^2; else that of all
  double static_evidence = 1.0;           ///< how much it tells of the camera, as multiples of a new point
};

/// A point that a first camera measured, as a second one sees it.
struct PointInSecond {
  StereoPoint z;
  Eigen::Matrix<double, 3, 6> J_motion;  ///< d z / d T_first_second, right perturbation
  Matrix3<double> J_first;               ///< d z / d (u, v, d) in the first camera
};

/// Nothing if the point is not in front of the second camera.
[[nodiscard]] std::optional<PointInSecond> seen_by_second(const StereoPoint& first,
                                                          const Pose& T_second_first,
                                                          const StereoCamera& camera);

/// Positions in the current left image.
[[nodiscard]] inline std::vector<Vector2<double>> positions(const std::vector<StereoCorrespondence>& points) {
  std::vector<Vector2<double>> result;
  result.reserve(points.size());
  for (const auto& point : points) result.emplace_back(point.current.head<2>());
  return result;
}

/// Bundle adjustment of two stereo frames: the motion T_previous_current between them and the points they
/// share.
///
/// Both measurements of a point carry noise. Each Gauss-Newton step solves for the pose with the points
/// eliminated, and then updates the points in (u, v, d), where their noise is Gaussian and far points stay
/// unbiased. The covariances of the innovations are those at the motion `initial`; where steps with them
/// end more than a standard deviation from the minimum, as with disparities that are hardly larger than their
/// noise, they are computed anew in each step. Keeps references to the correspondences and the camera.
class TwoViewAdjustment {
 public:
  /// Measurements have the noise `sigma_px`; if `own_noise`, those with a covariance have that.
  TwoViewAdjustment(std::span<const StereoCorrespondence> correspondences, const StereoCamera& camera,
                    const Pose& initial, double sigma_px, bool own_noise = true);

  /// The motion that three correspondences give, by Gauss-Newton steps from `initial`. The points are taken
  /// as measured in the previous frame. Nothing if the three do not determine the motion.
  [[nodiscard]] std::optional<Pose> minimal_solution(const std::array<std::size_t, 3>& sample,
                                                     const Pose& initial) const;

  /// Squared Mahalanobis distance of every correspondence at a motion, infinite for points behind the camera.
  [[nodiscard]] std::vector<double> squared_distances(const Pose& T_previous_current) const;

  /// The adjustment of the correspondences whose flag is set, with Cauchy weights, from `initial`. Nothing if
  /// they do not determine the motion. Ends where the next step would lead away from the minimum, as steps do
  /// where the points hardly determine the motion. The covariance is the sandwich estimate of the weighted
  /// problem (Huber 1981), which follows the scale of the residuals.
  [[nodiscard]] std::optional<PoseGaussian> solve(const Pose& initial,
                                                  const std::vector<std::uint8_t>& is_used) const;

 private:
  std::span<const StereoCorrespondence> correspondences_;
  const StereoCamera& camera_;
  std::vector<Matrix3<double>> R_;
  std::vector<Matrix3<double>> S_inverse_;
};

}  // namespace stereo_slam
