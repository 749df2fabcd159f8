// SPDX-License-Identifier: MIT
#pragma once

#include <optional>

#include "stereo_slam/core/types.hpp"

/// Equations with symmetric matrices of six rows: covariances and information matrices of poses. They are no
/// templates, because Eigen's factorisations take seconds to compile in every source that uses them.
namespace stereo_slam {

/// e^T S^-1 e, the squared Mahalanobis distance of e from zero.
[[nodiscard]] double mahalanobis_squared(const Vector6<double>& e, const Matrix6<double>& S);

/// S^-1 B. Not finite if S is singular.
[[nodiscard]] Matrix6<double> solve_symmetric(const Matrix6<double>& S, const Matrix6<double>& B);

/// A^-1, or nothing if A is not positive definite.
[[nodiscard]] std::optional<Matrix6<double>> inverse_of_definite(const Matrix6<double>& A);

/// L^-1 with L L^T = P, which turns errors of covariance P into independent ones of variance one; or nothing
/// if P is not positive definite.
[[nodiscard]] std::optional<Matrix6<double>> whitening_matrix(const Matrix6<double>& P);

}  // namespace stereo_slam
