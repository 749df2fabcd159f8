// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>

#include <antipode/distributions/bingham.hpp>
#include <antipode/distributions/bingham_gaussian.hpp>
#include <antipode/eigen_types.hpp>

#include "support/random.hpp"

namespace antipode::test {

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

/// Orientation concentrations of 10^low to 10^high; coupling and covariance of order one.
template <class Scalar>
[[nodiscard]] BinghamGaussian<Scalar> random_bingham_gaussian(Rng& rng, double low, double high) {
  return {random_bingham<Scalar, 4>(rng, low, high), random_matrix<Scalar, 3, 1>(rng, 3.0),
          random_matrix<Scalar, 3>(rng), random_covariance<Scalar, 3>(rng)};
}

/// Largest entry of |A/B - 1|.
template <class A, class B>
[[nodiscard]] double max_relative_difference(const Eigen::MatrixBase<A>& a, const Eigen::MatrixBase<B>& b) {
  typename A::PlainObject ratio = a;
  const typename B::PlainObject divisor = b;
  for (Eigen::Index j = 0; j < ratio.cols(); ++j) {
    for (Eigen::Index i = 0; i < ratio.rows(); ++i) ratio(i, j) /= divisor(i, j);
  }
  return max_difference(ratio, A::PlainObject::Ones());
}

}  // namespace antipode::test
