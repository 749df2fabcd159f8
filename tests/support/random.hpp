// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <limits>
#include <random>

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

/// Uniform over the orthogonal matrices. Gram and Schmidt, twice: Eigen's QR costs the compiler a second for
/// every size and scalar.
template <class Scalar, int Dim>
[[nodiscard]] Matrix<Scalar, Dim> random_orthogonal(Rng& rng) {
  Matrix<double, Dim> Q;
  for (int i = 0; i < Dim; ++i) {
    Vector<double, Dim> v = random_unit<double, Dim>(rng);
    for (int pass = 0; pass < 2; ++pass) {
      for (int j = 0; j < i; ++j) v -= Q.col(j).dot(v) * Q.col(j);
      v.normalize();
    }
    Q.col(i) = v;
  }
  return Q.template cast<Scalar>();
}

/// Symmetric with eigenvalues between `smallest` and 1, in random directions.
template <class Scalar, int Dim>
[[nodiscard]] Matrix<Scalar, Dim> random_covariance(Rng& rng, double smallest = 0.01) {
  const Matrix<Scalar, Dim> Q = random_orthogonal<Scalar, Dim>(rng);
  Vector<Scalar, Dim> lambda;
  for (Scalar& entry : lambda) entry = uniform<Scalar>(rng, smallest, 1.0);
  Matrix<Scalar, Dim> A;
  for (int i = 0; i < Dim; ++i) {
    for (int j = 0; j <= i; ++j) A(i, j) = A(j, i) = Q.row(i).cwiseProduct(Q.row(j)).dot(lambda);
  }
  return A;
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
