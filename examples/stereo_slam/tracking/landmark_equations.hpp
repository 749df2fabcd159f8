// SPDX-License-Identifier: MIT
#pragma once

#include <antipode/filters/robust_least_squares.hpp>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/local_map/landmark.hpp"
#include "stereo_slam/tracking/whitened_matches.hpp"

namespace stereo_slam {

/// Matched landmarks as the model of robust_least_squares(): the counterpart of PoseLikelihood with
/// derivatives.
struct LandmarkEquations {
  const WhitenedMatches& matches;
  antipode::TruncatedLoss<double> noise;  ///< a cap on the squared distance of each landmark

  /// Adds all landmarks at a pose, and what they share with the prior, to antipode::WeightedSums.
  template <class Sums>
  void operator()(const Pose& T_keyframe_camera, Sums& sums) const {
    using Chart = PoseGaussian::Chart;
    const auto& shared = matches.shared;
    Vector6<double> y = Vector6<double>::Zero(), w = Vector6<double>::Zero();
    Matrix6<double> y_by_pose = Matrix6<double>::Zero(), w_by_pose = Matrix6<double>::Zero();
    if (shared) {
      const Vector6<double> xi = Chart::local(shared->prior, T_keyframe_camera);
      y = shared->whitening * xi;
      y_by_pose = shared->whitening * Chart::jacobian_inverse(xi);
    }
    for (const auto& [point, z, U, UV] : matches.matches) {
      const auto predicted = project(point, T_keyframe_camera, matches.camera);
      if (!predicted) {
        sums.miss(3);
        continue;
      }
      Vector3<double> e = U * (z - *predicted);
      antipode::Matrix<double, 3, 6> J = U * pose_jacobian(point, T_keyframe_camera, matches.camera);
      if (shared) {
        e -= UV * y;
        J += UV * y_by_pose;
        const double weight = noise.weight(e.squaredNorm(), 3);
        w += weight * (UV.transpose() * e);
        w_by_pose += weight * (UV.transpose() * J);
      }
      sums.template add<3>(e, Matrix3<double>::Identity(), J);
    }
    if (!shared) return;
    const Matrix6<double> slope = w_by_pose.transpose() * shared->information;
    sums.add_prior(slope * w_by_pose, slope * w, w.dot(shared->information * w));
  }
};

}  // namespace stereo_slam
