// SPDX-License-Identifier: MIT
#pragma once

#include <limits>
#include <random>

#include <Eigen/QR>

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

/// Entries uniform in [-size, size].
template <class Scalar, int Rows, int Cols = Rows>
[[nodiscard]] Matrix<Scalar, Rows, Cols> random_matrix(Rng& rng, double size = 1.0) {
  Matrix<Scalar, Rows, Cols> A;
  for (Scalar& entry : A.reshaped()) entry = uniform<Scalar>(rng, -size, size);
  return A;
}

/// Uniform on the unit sphere of R^Dim.
template <class Scalar, int Dim>
[[nodiscard]] Vector<Scalar, Dim> random_unit(Rng& rng) {
  std::normal_distribution<double> normal;
  Vector<double, Dim> v;
  for (double& entry : v) entry = normal(rng);
  return v.normalized().template cast<Scalar>().normalized();
}

template <class Scalar, int Dim>
[[nodiscard]] Matrix<Scalar, Dim> random_orthogonal(Rng& rng) {
  return random_matrix<Scalar, Dim>(rng).householderQr().householderQ();
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

/// Uniform over the rotations, of either sign.
template <class Scalar>
[[nodiscard]] Vector4<Scalar> random_quaternion(Rng& rng) {
  return random_unit<Scalar, 4>(rng);
}

/// A uniform rotation of either sign; translation entries uniform in [-size, size].
template <class Scalar>
[[nodiscard]] DualQuaternion<Scalar> random_pose(Rng& rng, double size = 3.0) {
  return DualQuaternion<Scalar>::from_rotation_translation(random_quaternion<Scalar>(rng),
                                                           random_matrix<Scalar, 3, 1>(rng, size));
}

/// A twist that turns by exactly `angle` about a random axis; entries of rho uniform in [-size, size].
template <class Scalar>
[[nodiscard]] Vector6<Scalar> random_twist(Rng& rng, double angle, double size = 3.0) {
  Vector6<Scalar> xi;
  xi << static_cast<Scalar>(angle) * random_unit<Scalar, 3>(rng), random_matrix<Scalar, 3, 1>(rng, size);
  return xi;
}

/// Largest entry of |A - B|.
template <class A, class B>
[[nodiscard]] double max_difference(const Eigen::MatrixBase<A>& a, const Eigen::MatrixBase<B>& b) {
  return static_cast<double>((a - b).cwiseAbs().maxCoeff());
}

}  // namespace antipode::test
