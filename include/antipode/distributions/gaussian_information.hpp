// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <concepts>
#include <limits>
#include <optional>

#include <antipode/detail/cholesky.hpp>
#include <antipode/eigen_types.hpp>

/// @file
/// Gaussians in information form, where the evidence of independent measurements adds up.
namespace antipode {

/// A Gaussian of N numbers x, up to a constant: log p(x) = x.vector - x^T information x / 2. Or what
/// measurements say of x, which is no density where the information is singular.
template <std::floating_point Scalar_, int N>
struct GaussianInformation {
  using Scalar = Scalar_;                                ///< of all numbers
  using Square = Matrix<Scalar, N>;                      ///< covariances and their inverses
  Square information = Square::Zero();                   ///< the inverse of the covariance
  Vector<Scalar, N> vector = Vector<Scalar, N>::Zero();  ///< information times mean

  /// N(mean, covariance). Not finite unless the covariance is positive definite.
  [[nodiscard]] static GaussianInformation from_covariance(const Vector<Scalar, N>& mean,
                                                           const Square& covariance) {
    const Square inverse = inverse_of(covariance);
    return {inverse, inverse * mean};
  }

  /// Both independent sources of evidence together: the product of the densities.
  [[nodiscard]] GaussianInformation operator+(const GaussianInformation& other) const {
    return {information + other.information, vector + other.vector};
  }
  /// This evidence without that of a part of it.
  [[nodiscard]] GaussianInformation operator-(const GaussianInformation& other) const {
    return {information - other.information, vector - other.vector};
  }

  /// Not finite unless the information is positive definite.
  [[nodiscard]] Vector<Scalar, N> mean() const {
    const auto L = detail::cholesky_factor<Scalar, N>(information);
    return L ? solved(*L, vector) : Vector<Scalar, N>::Constant(kNaN);
  }
  /// Not finite unless the information is positive definite.
  [[nodiscard]] Square covariance() const { return inverse_of(information); }

  /// log of the density at x, up to a constant.
  [[nodiscard]] Scalar log_density(const Vector<Scalar, N>& x) const {
    const Vector<Scalar, N> half = information * x;
    return x.dot(vector - Scalar(0.5) * half);
  }

  /// log of the density of what was measured, with this as the prior, up to a constant that does not depend
  /// on the prior. NaN unless the prior's information is positive definite.
  [[nodiscard]] Scalar log_evidence(const GaussianInformation& measured) const {
    using std::log;
    const auto prior = detail::cholesky_factor<Scalar, N>(information);
    const auto posterior = detail::cholesky_factor<Scalar, N>(information + measured.information);
    if (!prior || !posterior) return kNaN;
    const Vector<Scalar, N> mean = solved(*prior, vector);
    const Vector<Scalar, N> residual = measured.vector - measured.information * mean;
    const Scalar explained = detail::solve_lower<Scalar, N, 1>(*posterior, residual).squaredNorm();
    Scalar result = Scalar(0.5) * (mean.dot(measured.vector + residual) + explained);
    for (int i = 0; i < N; ++i) result += log((*prior)(i, i) / (*posterior)(i, i));
    return result;
  }

 private:
  static constexpr Scalar kNaN = std::numeric_limits<Scalar>::quiet_NaN();

  [[nodiscard]] static Vector<Scalar, N> solved(const Square& L, const Vector<Scalar, N>& b) {
    return detail::solve_lower_transposed<Scalar, N, 1>(L, detail::solve_lower<Scalar, N, 1>(L, b));
  }
  [[nodiscard]] static Square inverse_of(const Square& A) {
    const auto L = detail::cholesky_factor<Scalar, N>(A);
    if (!L) return Square::Constant(kNaN);
    const Square root = detail::solve_lower<Scalar, N, N>(*L, Square::Identity());
    return root.transpose() * root;
  }
};

}  // namespace antipode
