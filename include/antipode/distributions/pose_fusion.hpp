// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>
#include <limits>
#include <numbers>

#include <antipode/detail/check.hpp>
#include <antipode/detail/cholesky.hpp>
#include <antipode/detail/least_squares.hpp>
#include <antipode/detail/positive_semidefinite.hpp>
#include <antipode/detail/products.hpp>
#include <antipode/detail/symmetric_eigen.hpp>
#include <antipode/distributions/pose_gaussian.hpp>
#include <antipode/distributions/state_gaussian.hpp>
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
  /// (they are half a turn apart, say), or a covariance is too ill-conditioned for its numbers (variances of
  /// 1e16 beside 1 along oblique axes).
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

  /// The estimates as rows of K d ~ k with unit variance. Their variances may differ by any factor.
  GaussianPair(const Matrix<Scalar, 12, 6>& K, const Vector<Scalar, 12>& k) {
    using std::log;
    const LeastSquares<Scalar, 12, 6> both(K, k);
    mean = both.x;
    covariance = scaled_square<Scalar, 6, 6>(both.root, Vector6<Scalar>::Ones());
    mahalanobis_squared = both.squared_residual;
    // |A + B| = |A| |A^-1 + B^-1| |B|
    const auto log_determinant = [&](int first) {
      return LeastSquares<Scalar, 6, 6>(K.template middleRows<6>(first), k.template segment<6>(first))
          .log_determinant;
    };
    log_evidence = log_determinant(0) + log_determinant(6) - both.log_determinant -
                   Scalar(3) * log(Scalar(2) * std::numbers::pi_v<Scalar>) -
                   Scalar(0.5) * mahalanobis_squared;
  }

  /// A and B may be singular. Directions in which both have no variance are left out. The mean is not finite
  /// if a variance is lost in the rounding errors of others.
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
    bool resolved = true;
    Matrix6<Scalar> whitening = Matrix6<Scalar>::Zero();  // W W^T = S^-1 on the range of S
    for (int k = 0; k < 6; ++k) {
      const Scalar lambda = eigen.values[k];
      if (!(lambda > smallest)) {
        const Vector6<Scalar> direction = scale.cwiseProduct(eigen.vectors.col(k));
        resolved &= !has_variance(A, direction, smallest) && !has_variance(B, direction, smallest);
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
    if (!resolved) mean.setConstant(std::numeric_limits<Scalar>::quiet_NaN());
  }

 private:
  /// Whether the covariance has a variance along w that is not a rounding error of its own entries.
  [[nodiscard]] static bool has_variance(const Matrix6<Scalar>& A, const Vector6<Scalar>& w,
                                         Scalar rounding) {
    Scalar variance(0), size(0);
    for (int j = 0; j < 6; ++j) {
      size += w[j] * w[j] * A(j, j);
      for (int i = 0; i < 6; ++i) variance += w[i] * w[j] * A(i, j);
    }
    return variance > rounding * size;
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

/// An estimate with a root of its covariance.
template <class Scalar, class Chart>
struct CheckedEstimate {
  PoseGaussian<Scalar, Chart> density;
  RootOfCovariance<Scalar, 6> root;

  /// Throws unless the covariance is finite, symmetric and positive semidefinite, and the pose finite.
  explicit CheckedEstimate(const PoseGaussian<Scalar, Chart>& x) : density(x), root(root_of(x)) {
    Chart::require_finite(x.pose);
  }

  /// The estimate as rows of K d ~ k with unit variance, d in x exp(d): L^-1 (r + J_r(r)^-1 d).
  void set_rows(int first, const DualQuaternion<Scalar>& x, Matrix<Scalar, 12, 6>& K,
                Vector<Scalar, 12>& k) const {
    const Vector6<Scalar> r = Chart::local(density.pose, x);
    K.template middleRows<6>(first) = solve_lower<Scalar, 6, 6>(root.L, Chart::jacobian_inverse(r));
    k.template segment<6>(first) = -solve_lower<Scalar, 6, 1>(root.L, r);
  }
};

/// The product of both estimates near x, from covariances if one of them is singular.
template <class Scalar, class Chart>
[[nodiscard]] GaussianPair<Scalar> product_near(const DualQuaternion<Scalar>& x,
                                                const CheckedEstimate<Scalar, Chart>& a,
                                                const CheckedEstimate<Scalar, Chart>& b) {
  if (a.root.positive_definite && b.root.positive_definite) {
    Matrix<Scalar, 12, 6> K;
    Vector<Scalar, 12> k;
    a.set_rows(0, x, K, k);
    b.set_rows(6, x, K, k);
    return {K, k};
  }
  const LinearizedEstimate<Scalar> at_a(a.density, x), at_b(b.density, x);
  return {at_a.mean, at_a.covariance, at_b.mean, at_b.covariance};
}

/// The largest coordinate of a step, in standard deviations; of the wider estimate where the result's is
/// zero.
template <class Scalar, class Chart>
[[nodiscard]] Scalar step_size(const Vector6<Scalar>& step, const Matrix6<Scalar>& covariance,
                               const CheckedEstimate<Scalar, Chart>& a,
                               const CheckedEstimate<Scalar, Chart>& b) {
  Scalar largest(0);
  for (int i = 0; i < 6; ++i) {
    Scalar variance = covariance(i, i);
    if (!(variance > Scalar(0))) {
      variance = std::max(a.density.covariance(i, i), b.density.covariance(i, i));
    }
    // Both are certain: the step is rounding, or they contradict each other.
    if (!(variance > Scalar(0))) continue;
    largest = std::max(largest, std::abs(step[i]) / std::sqrt(variance));
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
  const detail::CheckedEstimate<Scalar, Chart> checked_a(a), checked_b(b);
  PoseFusion<PoseGaussian<Scalar, Chart>> result{.density = a};
  constexpr Scalar kRounding = Scalar(0.02);  // standard deviations; of poses in float far from the origin
  Scalar last_step = std::numeric_limits<Scalar>::infinity();
  DualQuaternion<Scalar>& x = result.density.pose;
  while (!result.converged && result.iterations < options.max_iterations) {
    const auto y = detail::product_near(x, checked_a, checked_b);
    ++result.iterations;
    if (!detail::all_finite(y.mean) || !detail::all_finite(y.covariance)) break;
    x = Chart::normalized(Chart::retract(x, y.mean));
    result.density.covariance = y.covariance;
    result.mahalanobis_squared = y.mahalanobis_squared;
    result.log_evidence = y.log_evidence;
    const Scalar step = detail::step_size(y.mean, y.covariance, checked_a, checked_b);
    const bool settled = step <= options.tolerance || (step <= kRounding && step >= last_step);
    result.converged = settled && std::isfinite(result.mahalanobis_squared);
    last_step = step;
  }
  return result;
}

}  // namespace antipode
