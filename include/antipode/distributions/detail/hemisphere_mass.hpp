// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include <Eigen/Geometry>

#include <antipode/detail/products.hpp>
#include <antipode/detail/symmetric_eigen.hpp>
#include <antipode/eigen_types.hpp>

/// The normaliser of a projected Gaussian by a one-dimensional integral (MPG Eq. 12, for which the paper uses
/// Monte Carlo).
///
/// On a hemisphere the Gaussian on its tangent space has the mass C = E[(1 + |u|^2)^-2], u ~ N(m, Sigma), as
/// dq = (1 + |u|^2)^-2 du. With (1 + r)^-2 = int_0^inf s e^(-s (1 + r)) ds the expectation is that of a
/// Gaussian:
///
///   C = int_0^inf s e^-s  det(I + 2 s Sigma)^(-1/2)  exp(-s m^T (I + 2 s Sigma)^-1 m)  ds
///
/// Everything is computed in double. The functions are templates on Real, which is always double, so that
/// they are compiled only where they are used. They are plain loops, because every projected Gaussian
/// compiles them.
namespace antipode::detail {

/// int_0^inf s e^-s f(s) ds ~ sum_k weights_k f(nodes_k).
template <class Real, std::size_t Count>
struct TiltRule {
  std::array<Real, Count> nodes, weights;
};

/// Gauss-Laguerre: to 2e-14 for tr Sigma + |m|^2 <= 0.05. Nodes and weights are eigenvalues and first
/// components of the eigenvectors of the recurrence's matrix (Golub and Welsch, "Calculation of Gauss
/// quadrature rules", 1969).
template <class Real>
[[nodiscard]] const TiltRule<Real, 12>& concentrated_tilt_rule() {
  static const TiltRule<Real, 12> rule = [] {
    Matrix<Real, 12> recurrence = Matrix<Real, 12>::Zero();
    for (int k = 0; k < 12; ++k) {
      recurrence(k, k) = 2.0 * (k + 1);
      if (k > 0) recurrence(k, k - 1) = recurrence(k - 1, k) = std::sqrt(k * (k + 1.0));
    }
    const auto eigen = symmetric_eigen(recurrence);
    TiltRule<Real, 12> result;
    for (int k = 0; k < 12; ++k) {
      const auto node = static_cast<std::size_t>(k);
      result.nodes[node] = eigen.values[k];
      result.weights[node] = eigen.vectors(0, k) * eigen.vectors(0, k);
    }
    return result;
  }();
  return rule;
}

/// The trapezoidal rule in x with s = exp(x - e^-x), which decays double exponentially at both ends: to 2e-15
/// for tr Sigma + |m|^2 <= 3.
template <class Real>
[[nodiscard]] const TiltRule<Real, 32>& moderate_tilt_rule() {
  static const TiltRule<Real, 32> rule = [] {
    constexpr double kStep = 0.22;
    TiltRule<Real, 32> result;
    for (std::size_t k = 0; k < 32; ++k) {
      const double x = -3.2 + static_cast<double>(k) * kStep;
      const double s = std::exp(x - std::exp(-x));
      result.nodes[k] = s;
      result.weights[k] = kStep * s * s * std::exp(-s) * (1.0 + std::exp(-x));
    }
    return result;
  }();
  return rule;
}

/// The trapezoidal rule in log s: to 4e-15 for eigenvalues of Sigma and |m|^2 up to 1e8.
template <class Real>
[[nodiscard]] const TiltRule<Real, 172>& wide_tilt_rule() {
  static const TiltRule<Real, 172> rule = [] {
    TiltRule<Real, 172> result;
    for (std::size_t k = 0; k < 172; ++k) {
      const double s = std::exp(0.25 * static_cast<double>(k) - 39.0);
      result.nodes[k] = s;
      result.weights[k] = 0.25 * s * s * std::exp(-s);
    }
    return result;
  }();
  return rule;
}

/// The first node of the wide rule that is not negligible: the ones before it have s (1 + 2 size) < e^-19.5.
/// Its index is even.
[[nodiscard]] inline std::size_t first_wide_node(double size) {
  return 2 * static_cast<std::size_t>(std::clamp((19.5 - std::log1p(2.0 * size)) / 0.5, 0.0, 60.0));
}

/// The integrand as polynomials in x = 2 s:
///
///   det(I + x Sigma) = 1 + x (e1 + x (e2 + x e3)),
///   m^T (I + x Sigma)^-1 m det(I + x Sigma) = m0 + x (m1 + x m2)
template <class Real>
struct TiltPolynomials {
  Real e1, e2, e3, m0, m1, m2;

  /// From the entries of Sigma; rounding errors cost up to tr(Sigma)^2 ulps of the integral.
  [[nodiscard]] static TiltPolynomials from_matrix(const Vector3<Real>& m, const Matrix3<Real>& Sigma) {
    const Vector3<Real> a = Sigma.col(0), b = Sigma.col(1), c = Sigma.col(2);
    Matrix3<Real> adjugate;
    adjugate.col(0) = b.cross(c);
    adjugate.col(1) = c.cross(a);
    adjugate.col(2) = a.cross(b);
    const Real e1 = Sigma.trace(), m0 = m.squaredNorm();
    const Vector3<Real> Sigma_m = Sigma * m, adjugate_m = adjugate * m;
    return {e1, adjugate.trace(), a.dot(b.cross(c)), m0, e1 * m0 - m.dot(Sigma_m), m.dot(adjugate_m)};
  }

  /// From the eigenvalues of Sigma: all terms are positive, so that none cancel.
  [[nodiscard]] static TiltPolynomials from_eigen(const Vector3<Real>& m, const Matrix3<Real>& Sigma) {
    const auto eigen = symmetric_eigen(Sigma);
    const Vector3<Real> x = eigen.vectors.transpose() * m;
    const Vector3<Real> squares(x[0] * x[0], x[1] * x[1], x[2] * x[2]);
    const Real a = std::max(0.0, eigen.values[0]), b = std::max(0.0, eigen.values[1]), c = eigen.values[2];
    return {a + b + c,
            a * b + b * c + c * a,
            a * b * c,
            squares.sum(),
            squares.dot(Vector3<Real>(b + c, c + a, a + b)),
            squares.dot(Vector3<Real>(b * c, c * a, a * b))};
  }

  /// The integral by the nodes from index `first` on.
  template <std::size_t Count>
  [[nodiscard]] Real integrate(const TiltRule<Real, Count>& rule, std::size_t first = 0) const {
    std::array<Real, Count> factors, exponentials;
    for (std::size_t k = first; k < Count; ++k) {
      const Real s = rule.nodes[k], x = 2.0 * s;
      const Real determinant = 1.0 + x * (e1 + x * (e2 + x * e3));
      factors[k] = rule.weights[k] / std::sqrt(determinant);
      exponentials[k] = -s * (m0 + x * (m1 + x * m2)) / determinant;
    }
    if (m0 != 0.0) {  // Eigen's exponential computes two at a time
      Eigen::Map<Eigen::Array<Real, Eigen::Dynamic, 1>> e(exponentials.data() + first,
                                                          static_cast<Eigen::Index>(Count - first));
      e = e.exp();
      for (std::size_t k = first; k < Count; ++k) factors[k] *= exponentials[k];
    }
    Real sum = 0.0;
    for (std::size_t k = first; k < Count; ++k) sum += factors[k];
    return sum;
  }
};

/// C = E[(1 + |u|^2)^-2] for u ~ N(m, Sigma), in (0, 1]; Sigma positive semidefinite, eigenvalues and |m|^2
/// up to 1e8. Relative error 1e-12, and 2e-14 for tr Sigma + |m|^2 <= 3.
template <class Real>
[[nodiscard]] Real hemisphere_mass(const Vector3<Real>& m, const Matrix3<Real>& Sigma) {
  const Real size = Sigma.trace() + m.squaredNorm();
  if (size <= 3.0) {
    const auto f = TiltPolynomials<Real>::from_matrix(m, Sigma);
    return size <= 0.05 ? f.integrate(concentrated_tilt_rule<Real>())
                        : f.integrate(moderate_tilt_rule<Real>());
  }
  const auto f = size <= 30.0 ? TiltPolynomials<Real>::from_matrix(m, Sigma)
                              : TiltPolynomials<Real>::from_eigen(m, Sigma);
  return f.integrate(wide_tilt_rule<Real>(), first_wide_node(size));
}

/// C and the moments of u under N(m, Sigma) (1 + |u|^2)^-2 / C, the renormalised density on the tangent
/// space.
template <class Real>
struct TiltedMoments {
  Real hemisphere_mass;
  Vector3<Real> mean;
  Matrix3<Real> second_moment;  ///< E[u u^T]
};

/// Given s the tilted u is Gaussian: N(A m, A Sigma) with A = (I + 2 s Sigma)^-1. For Sigma and m as in
/// hemisphere_mass.
template <class Real>
[[nodiscard]] TiltedMoments<Real> tilted_moments(const Vector3<Real>& m, const Matrix3<Real>& Sigma) {
  const TiltRule<Real, 172>& rule = wide_tilt_rule<Real>();
  const auto eigen = symmetric_eigen(Sigma);
  const Matrix3<Real>& V = eigen.vectors;
  const Vector3<Real> mu = V.transpose() * m;
  Real mass = 0.0;
  Vector3<Real> mean = Vector3<Real>::Zero();
  Matrix3<Real> second = Matrix3<Real>::Zero();
  for (std::size_t k = 0; k < 172; ++k) {
    const Real s = rule.nodes[k];
    Vector3<Real> center, variance;
    Real shrink_product = 1.0, exponent = 0.0;
    for (int i = 0; i < 3; ++i) {
      const Real lambda = std::max(eigen.values[i], 0.0), shrink = 1.0 / (1.0 + 2.0 * s * lambda);
      center[i] = shrink * mu[i];
      variance[i] = shrink * lambda;
      shrink_product *= shrink;
      exponent -= s * center[i] * mu[i];
    }
    const Real weight = rule.weights[k] * std::sqrt(shrink_product) * std::exp(exponent);
    mass += weight;
    for (int j = 0; j < 3; ++j) {
      mean[j] += weight * center[j];
      for (int i = 0; i < 3; ++i) second(i, j) += weight * center[i] * center[j];
      second(j, j) += weight * variance[j];
    }
  }
  const Vector3<Real> V_mean = V * mean;
  return {mass, V_mean / mass, congruence<Real, 3, 3>(V, second) / mass};
}

}  // namespace antipode::detail
