// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include <Eigen/QR>

#include <antipode/distributions/bingham.hpp>
#include <antipode/distributions/bingham_gaussian.hpp>
#include <antipode/distributions/gaussian.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/geometry/dual_quaternion.hpp>

/// Random arguments for property tests. Every test seeds its own generator and captures the seed.
namespace antipode::test {

using Rng = std::mt19937_64;

/// Rounding unit of a scalar, as a double: tolerances are computed in double.
template <class Scalar>
inline constexpr double kEpsilon = static_cast<double>(std::numeric_limits<Scalar>::epsilon());

template <class Scalar>
[[nodiscard]] Scalar uniform(Rng& rng, double low, double high) {
  return static_cast<Scalar>(std::uniform_real_distribution<double>(low, high)(rng));
}

template <class Scalar, int Rows, int Cols = Rows>
[[nodiscard]] Matrix<Scalar, Rows, Cols> random_matrix(Rng& rng, double size = 1.0) {
  Matrix<Scalar, Rows, Cols> A;
  for (Scalar& entry : A.reshaped()) entry = uniform<Scalar>(rng, -size, size);
  return A;
}

template <class Scalar, int Dim>
[[nodiscard]] Matrix<Scalar, Dim> random_orthogonal(Rng& rng) {
  return random_matrix<Scalar, Dim>(rng).householderQr().householderQ();
}

template <class Scalar, int Dim>
[[nodiscard]] Vector<Scalar, Dim> random_unit(Rng& rng) {
  return detail::standard_normal<Scalar, Dim>(rng).normalized();
}

/// Symmetric with eigenvalues between `smallest` and 1, in random directions.
template <class Scalar, int Dim>
[[nodiscard]] Matrix<Scalar, Dim> random_covariance(Rng& rng, double smallest = 0.01) {
  const Matrix<Scalar, Dim> Q = random_orthogonal<Scalar, Dim>(rng);
  Vector<Scalar, Dim> lambda;
  for (Scalar& entry : lambda) entry = uniform<Scalar>(rng, smallest, 1.0);
  const Matrix<Scalar, Dim> A = Q * lambda.asDiagonal() * Q.transpose();
  return Scalar(0.5) * (A + A.transpose());
}

/// Concentrations ascending to 0, the others -10^e with e uniform in [low, high].
template <class Scalar, int Dim>
[[nodiscard]] Vector<Scalar, Dim> random_concentrations(Rng& rng, double low, double high) {
  Vector<Scalar, Dim> z;
  for (Scalar& entry : z) entry = -std::pow(Scalar(10), uniform<Scalar>(rng, low, high));
  z[Dim - 1] = Scalar(0);
  std::sort(z.begin(), z.end());
  return z;
}

template <class Scalar, int Dim>
[[nodiscard]] Bingham<Scalar, Dim> random_bingham(Rng& rng, double low, double high) {
  return Bingham<Scalar, Dim>::from_parameters(random_orthogonal<Scalar, Dim>(rng),
                                               random_concentrations<Scalar, Dim>(rng, low, high));
}

template <class Scalar>
[[nodiscard]] DualQuaternion<Scalar> random_pose(Rng& rng, double size = 3.0) {
  return DualQuaternion<Scalar>::from_rotation_translation(random_unit<Scalar, 4>(rng),
                                                           random_matrix<Scalar, 3, 1>(rng, size));
}

/// Orientation concentrations of 10^low to 10^high, coupling and translations of order one.
template <class Scalar>
[[nodiscard]] BinghamGaussian<Scalar> random_bingham_gaussian(Rng& rng, double low, double high) {
  return {random_bingham<Scalar, 4>(rng, low, high), random_matrix<Scalar, 3, 1>(rng, 3.0),
          random_matrix<Scalar, 3>(rng), random_covariance<Scalar, 3>(rng)};
}

/// Largest entry of |A - B|.
template <class A, class B>
[[nodiscard]] double max_difference(const Eigen::MatrixBase<A>& a, const Eigen::MatrixBase<B>& b) {
  return static_cast<double>((a - b).cwiseAbs().maxCoeff());
}

/// Largest entry of |A/B - 1|.
template <class A, class B>
[[nodiscard]] double max_relative_difference(const Eigen::MatrixBase<A>& a, const Eigen::MatrixBase<B>& b) {
  using Scalar = typename A::Scalar;
  return static_cast<double>((a.array() / b.array() - Scalar(1)).abs().maxCoeff());
}

}  // namespace antipode::test
