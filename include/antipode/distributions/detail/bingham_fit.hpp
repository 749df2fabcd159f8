// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <limits>

#include <antipode/detail/cholesky.hpp>
#include <antipode/distributions/detail/bingham_contour.hpp>
#include <antipode/eigen_types.hpp>

namespace antipode::detail {

/// Concentrations z (ascending, the last 0) with the log-normaliser and the second moments they give.
template <int Dim>
struct BinghamMomentSolution {
  Vector<double, Dim> z;
  double log_normalizer;
  Vector<double, Dim> second_moments;
};

/// Solves E[x_i^2] = target_i for z; the targets are ascending, at least 1e-15, and sum to one.
///
/// log N is strictly convex in z up to a shift, so the solution is unique. Newton's method on the reciprocals
/// 1/omega_i, which are nearly linear in z, from the leading saddlepoint relation omega_i ~ 1/(2 (s0 - z_i)):
/// four iterations on average for any concentration. Scaled by omega the Jacobian is the covariance
/// matrix of x_i^2/omega_i: symmetric, positive definite and of order one.
template <int Dim>
[[nodiscard]] BinghamMomentSolution<Dim> solve_bingham_moments(const Vector<double, Dim>& target) {
  constexpr int kFree = Dim - 1;  // the last z stays 0
  constexpr int kMaxIterations = 50;
  constexpr double kResidual = 1e-13, kAcceptableResidual = 1e-12;

  BinghamMomentSolution<Dim> solution;
  Vector<double, Dim>& z = solution.z;
  for (int i = 0; i < Dim; ++i) z[i] = 0.5 / target[Dim - 1] - 0.5 / target[i];
  double previous_residual = std::numeric_limits<double>::infinity();
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    const BinghamContourSum<Dim> sum(z);
    const Vector<double, Dim> omega = sum.second_moments();
    solution.log_normalizer = sum.log_normalizer();
    solution.second_moments = omega;
    Vector<double, Dim> defect;  // relative
    for (int i = 0; i < Dim; ++i) defect[i] = 1.0 - omega[i] / target[i];
    const double residual = defect.cwiseAbs().maxCoeff();
    if (residual < kResidual || (residual < kAcceptableResidual && residual > 0.5 * previous_residual)) break;
    previous_residual = residual;

    const Matrix<double, Dim> fourth = sum.fourth_moments();
    Matrix<double, kFree> jacobian;
    for (int i = 0; i < kFree; ++i) {
      for (int j = 0; j < kFree; ++j) jacobian(i, j) = fourth(i, j) / (omega[i] * omega[j]) - 1.0;
    }
    const auto step = solve_positive_definite<double, kFree>(jacobian, defect.template head<kFree>());
    for (int i = 0; i < kFree; ++i) z[i] = std::min(z[i] + step[i] / omega[i], 0.0);
  }
  std::sort(z.begin(), z.end());  // equal targets may differ by a rounding error
  return solution;
}

}  // namespace antipode::detail
