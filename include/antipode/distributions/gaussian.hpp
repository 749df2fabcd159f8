// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <concepts>
#include <numbers>
#include <random>
#include <stdexcept>

#include <antipode/detail/check.hpp>
#include <antipode/detail/positive_semidefinite.hpp>
#include <antipode/detail/standard_normal.hpp>
#include <antipode/eigen_types.hpp>

/// @file
/// The Gaussian density of vectors.
namespace antipode {

/// The Gaussian density N(mean, covariance) on R^Dim.
///
/// The covariance may be singular (positive semidefinite, down to zero): everything works but log_density.
template <std::floating_point Scalar_, int Dim>
class Gaussian {
 public:
  using Scalar = Scalar_;                  ///< of coordinates and densities
  static constexpr int kDim = Dim;         ///< of the space
  using Mean = Vector<Scalar, Dim>;        ///< a point of R^Dim
  using Covariance = Matrix<Scalar, Dim>;  ///< Dim x Dim

  /// Throws std::invalid_argument unless both are finite and the covariance is symmetric and positive
  /// semidefinite, within 1e-9 relative.
  Gaussian(const Mean& mean, const Covariance& covariance)
      : mean_(mean),
        covariance_(detail::checked_covariance("covariance is not finite or not symmetric", covariance)),
        root_(detail::root_of_covariance("covariance has a negative eigenvalue", covariance_)) {
    detail::require_finite("mean is not finite", mean);
  }

  /// N(0, I).
  [[nodiscard]] static Gaussian standard() { return {Mean::Zero(), Covariance::Identity()}; }

  /// The mean, which is also the mode.
  [[nodiscard]] const Mean& mean() const noexcept { return mean_; }
  /// The covariance, symmetric.
  [[nodiscard]] const Covariance& covariance() const noexcept { return covariance_; }

  /// L with L L^T = covariance: the lower Cholesky factor, or V sqrt(lambda) where the covariance is
  /// singular.
  [[nodiscard]] const Covariance& sqrt_factor() const noexcept { return root_.L; }

  /// log N(x; mean, covariance).
  /// Throws std::domain_error if the covariance is singular: there is no density then.
  [[nodiscard]] Scalar log_density(const Mean& x) const {
    using std::log;
    if (!root_.positive_definite)
      throw std::domain_error("a Gaussian with a singular covariance has no density");
    const Mean whitened = detail::solve_lower<Scalar, Dim, 1>(root_.L, x - mean_);
    Scalar log_root_determinant(0);
    for (int i = 0; i < Dim; ++i) log_root_determinant += log(root_.L(i, i));
    return Scalar(-0.5) *
               (whitened.squaredNorm() + Scalar(Dim) * log(Scalar(2) * std::numbers::pi_v<Scalar>)) -
           log_root_determinant;
  }

  /// An exact draw.
  template <std::uniform_random_bit_generator Rng>
  [[nodiscard]] Mean sample(Rng& rng) const {
    return mean_ + root_.L * detail::standard_normal<Scalar, Dim>(rng);
  }

 private:
  Mean mean_;
  Covariance covariance_;
  detail::RootOfCovariance<Scalar, Dim> root_;
};

}  // namespace antipode
