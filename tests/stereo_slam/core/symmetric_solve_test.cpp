// SPDX-License-Identifier: MIT
#include "stereo_slam/core/symmetric_solve.hpp"

#include <cmath>
#include <limits>
#include <random>

#include <Eigen/LU>

#include "support/catch.hpp"

namespace {

using stereo_slam::Matrix6;
using stereo_slam::Vector6;

/// B B^T + I, whose condition number is below 100.
Matrix6<double> random_definite(std::mt19937& rng) {
  std::uniform_real_distribution<double> entry(-1.0, 1.0);
  const Matrix6<double> B = Matrix6<double>::NullaryExpr([&] { return entry(rng); });
  return B * B.transpose() + Matrix6<double>::Identity();
}

constexpr double kTolerance = 1e-12;  // condition number times the rounding unit, with room for six rows

}  // namespace

TEST_CASE("Solutions with symmetric matrices are those of the inverse", "[symmetric_solve]") {
  std::mt19937 rng(1);
  std::uniform_real_distribution<double> entry(-1.0, 1.0);
  for (int trial = 0; trial < 100; ++trial) {
    const Matrix6<double> A = random_definite(rng);
    const Matrix6<double> A_inverse = A.inverse();
    const Vector6<double> b = Vector6<double>::NullaryExpr([&] { return entry(rng); });
    CHECK(std::abs(stereo_slam::mahalanobis_squared(b, A) - b.dot(A_inverse * b)) < kTolerance);
    CHECK((stereo_slam::solve_symmetric(A, Matrix6<double>::Identity()) - A_inverse).norm() < kTolerance);
    CHECK((stereo_slam::inverse_of_definite(A).value() - A_inverse).norm() < kTolerance);
    const Matrix6<double> W = stereo_slam::whitening_matrix(A).value();
    CHECK((W * A * W.transpose() - Matrix6<double>::Identity()).norm() < kTolerance);
  }
}

TEST_CASE("Matrices that are not positive definite are told", "[symmetric_solve]") {
  Matrix6<double> indefinite = Matrix6<double>::Identity();
  indefinite(4, 4) = -1.0;
  Matrix6<double> nan = Matrix6<double>::Identity();
  nan(5, 5) = std::numeric_limits<double>::quiet_NaN();
  for (const Matrix6<double>& P : {indefinite, nan, Matrix6<double>(Matrix6<double>::Zero())}) {
    CHECK_FALSE(stereo_slam::inverse_of_definite(P));
    CHECK_FALSE(stereo_slam::whitening_matrix(P));
  }
}
