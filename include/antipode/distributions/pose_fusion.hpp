// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>
#include <limits>
#include <numbers>

#include <antipode/detail/positive_semidefinite.hpp>
#include <antipode/detail/products.hpp>
#include <antipode/detail/symmetric_eigen.hpp>
#include <antipode/distributions/pose_gaussian.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/geometry/chart.hpp>
#include <antipode/geometry/dual_quaternion.hpp>

/// @file
/// The fusion of independent estimates of one pose, by Gauss-Newton in the tangent space.
namespace antipode {

/// When the iteration of a fusion ends.
template <std::floating_point Scalar>
struct PoseFusionOptions {
  /// The iteration has converged when a step is shorter than this, in standard deviations, or when short
  /// steps no longer shrink, because they are rounding.
  Scalar tolerance = std::max(Scalar(1e-6), Scalar(10) * std::numeric_limits<Scalar>::epsilon());
  int max_iterations = 50;  ///< most steps; after them the fusion has not converged
};

/// The result of the fusion of two pose densities.
template <class Density>
struct PoseFusion {
  using Scalar = typename Density::Scalar;  ///< of coordinates and densities

  Density density;  ///< of the pose, given both estimates
  /// Whether the iteration has settled. If not, do not use the density: the estimates contradict each other
  /// (they are half a turn apart, say).
  bool converged = false;
  int iterations = 0;  ///< steps taken
  /// The squared Mahalanobis distance of the two estimates: chi-square with six degrees of freedom (the rank
  /// of the sum of both covariances) if they are consistent. Infinite if they differ in a direction in which
  /// neither has a variance.
  Scalar mahalanobis_squared = 0;
  /// log of the integral of the product of both densities: to compare hypotheses by.
  Scalar log_evidence = 0;
};

namespace detail {

/// The product of two Gaussians: N(m_a, A) N(m_b, B) = evidence * N(mean, covariance).
template <class Scalar>
struct GaussianPair {
  Vector6<Scalar> mean;
  Matrix6<Scalar> covariance;
  Scalar mahalanobis_squared = 0, log_evidence = 0;

  /// A and B may be singular. Directions in which both have no variance are left out.
  GaussianPair(const Vector6<Scalar>& m_a, const Matrix6<Scalar>& A, const Vector6<Scalar>& m_b,
               const Matrix6<Scalar>& B) {
    using std::abs;
    using std::log;
    using std::sqrt;
    const Matrix6<Scalar> S = A + B;
    Vector6<Scalar> scale;  // makes the eigenvalues of S comparable
    for (int i = 0; i < 6; ++i) scale[i] = S(i, i) > Scalar(0) ? Scalar(1) / sqrt(S(i, i)) : Scalar(1);
    Matrix6<Scalar> correlation;
    for (int j = 0; j < 6; ++j) {
      for (int i = 0; i < 6; ++i) correlation(i, j) = scale[i] * S(i, j) * scale[j];
    }
    const auto eigen = symmetric_eigen(correlation);
    const Scalar smallest = Scalar(100) * std::numeric_limits<Scalar>::epsilon();
    const Vector6<Scalar> difference = m_b - m_a;
    const Vector6<Scalar> scaled_difference = scale.cwiseProduct(difference);
    const Scalar rounding = sqrt(smallest) * (Scalar(1) + scaled_difference.norm());
    Matrix6<Scalar> whitening = Matrix6<Scalar>::Zero();  // W W^T = S^-1 on the range of S
    for (int k = 0; k < 6; ++k) {
      const Scalar lambda = eigen.values[k];
      if (!(lambda > smallest)) {
        if (abs(eigen.vectors.col(k).dot(scaled_difference)) > rounding) {
          mahalanobis_squared = std::numeric_limits<Scalar>::infinity();
        }
        continue;
      }
      whitening.col(k) = scale.cwiseProduct(eigen.vectors.col(k)) / sqrt(lambda);
      log_evidence -= Scalar(0.5) * log(Scalar(2) * std::numbers::pi_v<Scalar> * lambda);
    }
    for (int i = 0; i < 6; ++i) log_evidence += log(scale[i]);
    const Vector6<Scalar> whitened = whitening.transpose() * difference;
    const Matrix6<Scalar> AW = A * whitening, BW = B * whitening;
    mean = m_a + AW * whitened;
    mahalanobis_squared += whitened.squaredNorm();
    log_evidence -= Scalar(0.5) * mahalanobis_squared;
    // A - A S^-1 A without its cancellation: A S^-1 B = (A W)(B W)^T.
    const Matrix6<Scalar> product = AW * BW.transpose();
    covariance = Scalar(0.5) * (product + product.transpose());
  }
};

/// An estimate a as a Gaussian of d in x exp(d). With r = log(a^-1 x), log(a^-1 x exp(d)) = r + J_r(r)^-1 d
/// to first order.
template <class Scalar>
struct LinearizedEstimate {
  Vector6<Scalar> mean;
  Matrix6<Scalar> covariance;

  template <class Chart>
  LinearizedEstimate(const PoseGaussian<Scalar, Chart>& a, const DualQuaternion<Scalar>& x) {
    const Vector6<Scalar> r = Chart::local(a.pose, x);
    const Matrix6<Scalar> J = Chart::jacobian(r);
    mean = -(J * r);
    covariance = congruence<Scalar, 6, 6>(J, a.covariance);
  }
};

/// The largest coordinate of a step, in standard deviations; in rad and m where the variance is zero.
template <class Scalar>
[[nodiscard]] Scalar step_size(const Vector6<Scalar>& step, const Matrix6<Scalar>& covariance) {
  Scalar largest(0);
  for (int i = 0; i < 6; ++i) {
    const Scalar variance = covariance(i, i);
    const Scalar sigma = variance > Scalar(0) ? std::sqrt(variance) : Scalar(1);
    largest = std::max(largest, std::abs(step[i]) / sigma);
  }
  return largest;
}

}  // namespace detail

/// The density of a pose given two independent estimates of it, a and b. Information that both share would
/// count twice.
///
/// The mode of the product of both densities, found by Gauss-Newton in the tangent space of the mode itself,
/// where both covariances are restated. This allows rotations of some tenths of a radian and long lever arms.
/// Variances may be zero: what one estimate knows exactly, the result knows exactly. Commutative. Throws
/// unless both covariances are finite, symmetric and positive semidefinite.
template <std::floating_point Scalar, class Chart>
[[nodiscard]] PoseFusion<PoseGaussian<Scalar, Chart>> fuse(const PoseGaussian<Scalar, Chart>& a,
                                                           const PoseGaussian<Scalar, Chart>& b,
                                                           const PoseFusionOptions<Scalar>& options = {}) {
  for (const PoseGaussian<Scalar, Chart>* x : {&a, &b}) {
    (void)detail::root_of_covariance<Scalar, 6>(
        "pose covariance has a negative eigenvalue",
        detail::checked_symmetric<Scalar, 6>("pose covariance is not finite or not symmetric",
                                             x->covariance));
    Chart::require_finite(x->pose);
  }
  PoseFusion<PoseGaussian<Scalar, Chart>> result{.density = a};
  constexpr Scalar kRounding = Scalar(0.02);  // standard deviations; of poses in float far from the origin
  Scalar last_step = std::numeric_limits<Scalar>::infinity();
  DualQuaternion<Scalar>& x = result.density.pose;
  while (!result.converged && result.iterations < options.max_iterations) {
    const detail::LinearizedEstimate<Scalar> at_a(a, x), at_b(b, x);
    const detail::GaussianPair<Scalar> y(at_a.mean, at_a.covariance, at_b.mean, at_b.covariance);
    ++result.iterations;
    if (!y.mean.allFinite()) break;
    x = Chart::normalized(Chart::retract(x, y.mean));
    result.density.covariance = y.covariance;
    result.mahalanobis_squared = y.mahalanobis_squared;
    result.log_evidence = y.log_evidence;
    const Scalar step = detail::step_size<Scalar>(y.mean, y.covariance);
    const bool settled = step <= options.tolerance || (step <= kRounding && step >= last_step);
    result.converged = settled && std::isfinite(result.mahalanobis_squared);
    last_step = step;
  }
  return result;
}

}  // namespace antipode
