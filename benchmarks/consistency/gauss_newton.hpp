// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Cholesky>

#include <antipode/geometry/jacobians.hpp>

#include "stereo_world.hpp"

namespace consistency {

/// A point measured by the stereo camera: information about the camera's pose alone, the point's uncertainty
/// is part of S.
struct PointMeasurement {
  Vector3<double> point;
  Vector3<double> z;
  Matrix3<double> S;
};

/// d z / d xi for a point p in camera coordinates under a right perturbation xi = (phi, rho) of the camera.
[[nodiscard]] inline Eigen::Matrix<double, 3, 6> measurement_jacobian(const StereoCamera& camera,
                                                                      const Vector3<double>& p_camera) {
  Eigen::Matrix<double, 3, 6> J;
  J << antipode::skew(p_camera), -Matrix3<double>::Identity();
  return camera.projection_jacobian(p_camera) * J;
}

/// The best linearised estimator: Gauss-Newton on prior and measurements with exact Jacobians, started at
/// `start`.
[[nodiscard]] inline PoseGaussian<double> gauss_newton(const PoseGaussian<double>& prior,
                                                       const std::vector<PointMeasurement>& measurements,
                                                       const StereoCamera& camera, const Pose& start) {
  constexpr int kIterations = 30;
  const Matrix6<double> prior_information = prior.covariance.inverse();
  Pose x = start;
  Matrix6<double> information;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    const Vector6<double> to_x = x.boxminus(prior.pose);
    const Matrix6<double> J_prior = antipode::se3_right_jacobian_inverse(to_x);
    information = J_prior.transpose() * prior_information * J_prior;
    Vector6<double> slope = -J_prior.transpose() * prior_information * to_x;
    for (const auto& m : measurements) {
      const Vector3<double> p = x.inverse() * m.point;
      const auto predicted = camera.project(p);
      if (!predicted) continue;
      const auto J = measurement_jacobian(camera, p);
      const Eigen::Matrix<double, 6, 3> weighted = m.S.llt().solve(J).transpose();
      information += weighted * J;
      slope += weighted * (m.z - *predicted);
    }
    const Vector6<double> step = information.llt().solve(slope);
    x = x.boxplus(step).renormalized();
    if (step.norm() < 1e-10) break;
  }
  return {x, information.inverse()};
}

}  // namespace consistency
