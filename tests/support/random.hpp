// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <limits>
#include <random>

#include <antipode/detail/products.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/geometry/dual_quaternion.hpp>

/// Random arguments for property tests. Every test seeds its own generator and captures the seed. No call
/// here draws two of its arguments: compilers evaluate them in different orders.
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
  for (int i = 0; i < Rows * Cols; ++i) A.data()[i] = uniform<Scalar>(rng, -size, size);
  return A;
}

/// Uniform on the unit sphere of R^Dim.
template <class Scalar, int Dim>
[[nodiscard]] Vector<Scalar, Dim> random_unit(Rng& rng) {
  std::normal_distribution<double> normal;
  double v[Dim], squared_norm = 0.0;
  for (double& entry : v) {
    entry = normal(rng);
    squared_norm += entry * entry;
  }
  Vector<Scalar, Dim> unit;
  for (int i = 0; i < Dim; ++i) unit[i] = static_cast<Scalar>(v[i] / std::sqrt(squared_norm));
  const Scalar norm = unit.norm();  // 1, but for rounding to Scalar
  for (int i = 0; i < Dim; ++i) unit[i] /= norm;
  return unit;
}

/// Uniform over the orthogonal matrices. Gram and Schmidt, twice: Eigen's QR costs the compiler a second for
/// every size and scalar.
template <class Scalar, int Dim>
[[nodiscard]] Matrix<Scalar, Dim> random_orthogonal(Rng& rng) {
  Matrix<double, Dim> Q;
  for (int i = 0; i < Dim; ++i) {
    Vector<double, Dim> v = random_unit<double, Dim>(rng);
    for (int pass = 0; pass < 2; ++pass) {
      for (int j = 0; j < i; ++j) {
        double share = 0.0;
        for (int k = 0; k < Dim; ++k) share += Q(k, j) * v[k];
        for (int k = 0; k < Dim; ++k) v[k] -= share * Q(k, j);
      }
      const double norm = v.norm();
      for (int k = 0; k < Dim; ++k) v[k] /= norm;
    }
    for (int k = 0; k < Dim; ++k) Q(k, i) = v[k];
  }
  Matrix<Scalar, Dim> rounded;
  for (int k = 0; k < Dim * Dim; ++k) rounded.data()[k] = static_cast<Scalar>(Q.data()[k]);
  return rounded;
}

/// Symmetric with eigenvalues between `smallest` and 1, in random directions.
template <class Scalar, int Dim>
[[nodiscard]] Matrix<Scalar, Dim> random_covariance(Rng& rng, double smallest = 0.01) {
  const Matrix<Scalar, Dim> Q = random_orthogonal<Scalar, Dim>(rng);
  Vector<Scalar, Dim> lambda;
  for (int i = 0; i < Dim; ++i) lambda[i] = uniform<Scalar>(rng, smallest, 1.0);
  return detail::scaled_square<Scalar, Dim, Dim>(Q, lambda);
}

/// Uniform over the rotations, of either sign.
template <class Scalar>
[[nodiscard]] Vector4<Scalar> random_quaternion(Rng& rng) {
  return random_unit<Scalar, 4>(rng);
}

/// A uniform rotation of either sign; translation entries uniform in [-size, size].
template <class Scalar>
[[nodiscard]] DualQuaternion<Scalar> random_pose(Rng& rng, double size = 3.0) {
  const Vector3<Scalar> translation = random_matrix<Scalar, 3, 1>(rng, size);
  return DualQuaternion<Scalar>::from_rotation_translation(random_quaternion<Scalar>(rng), translation);
}

/// A twist that turns by exactly `angle` about a random axis; entries of rho uniform in [-size, size].
template <class Scalar>
[[nodiscard]] Vector6<Scalar> random_twist(Rng& rng, double angle, double size = 3.0) {
  const Vector3<Scalar> axis = random_unit<Scalar, 3>(rng);
  const Vector3<Scalar> rho = random_matrix<Scalar, 3, 1>(rng, size);
  Vector6<Scalar> xi;
  for (int i = 0; i < 3; ++i) {
    xi[i] = static_cast<Scalar>(angle) * axis[i];
    xi[3 + i] = rho[i];
  }
  return xi;
}

/// Largest entry of |A - B|; NaN if there is one, infinite if they differ in size.
template <class A, class B>
[[nodiscard]] double max_difference(const Eigen::MatrixBase<A>& a, const Eigen::MatrixBase<B>& b) {
  const typename A::PlainObject left = a;
  const typename B::PlainObject right = b;
  if (left.rows() != right.rows() || left.cols() != right.cols()) {
    return std::numeric_limits<double>::infinity();
  }
  double largest = 0.0;
  for (Eigen::Index j = 0; j < left.cols(); ++j) {
    for (Eigen::Index i = 0; i < left.rows(); ++i) {
      const double difference = std::abs(static_cast<double>(left(i, j)) - static_cast<double>(right(i, j)));
      if (!(difference <= largest)) largest = difference;
      if (std::isnan(difference)) return difference;
    }
  }
  return largest;
}

}  // namespace antipode::test
