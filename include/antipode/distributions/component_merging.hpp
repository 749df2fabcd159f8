// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>
#include <limits>
#include <stdexcept>

#include <antipode/detail/cholesky.hpp>
#include <antipode/detail/products.hpp>
#include <antipode/distributions/detail/tangent_chart.hpp>
#include <antipode/distributions/projected_gaussian.hpp>
#include <antipode/eigen_types.hpp>

/// @file
/// Merging two components of a mixture: the component that replaces them, and what it costs (MPG Eqs. 23,
/// 24).
///
/// The divergences are exact for push-forward Gaussians on one tangent space. For renormalised Gaussians, and
/// after a change of the tangent space, their relative error is of the order of tr Sigma_uu.
namespace antipode {

/// What merging two components costs, in nats.
enum class MergeCriterion {
  /// (w log|S| - w_1 log|S_1| - w_2 log|S_2|) / 2: an upper bound of the Kullback-Leibler divergence from the
  /// mixture to the reduced one (Runnalls, "Kullback-Leibler approach to Gaussian mixture reduction", 2007).
  kRunnalls,
  /// w_1 d(p_1, p) + w_2 d(p, p_2) with the symmetric divergence d of MPG Eq. (23): an upper bound of d
  /// between the mixtures. MPG Eq. (24) also divides by w_1 + w_2, which makes the bound looser.
  kSymmetricKullbackLeibler,
};

namespace detail {

/// d_sKL of MPG Eq. (23), from roots of the covariances and the difference of the means: tr(S_2^-1 S_1 +
/// S_1^-1 S_2 + (S_1^-1 + S_2^-1) d d^T) / 2 - 6.
template <class Scalar>
[[nodiscard]] Scalar symmetric_kl(const Matrix6<Scalar>& L_1, const Matrix6<Scalar>& L_2,
                                  const Vector6<Scalar>& d) {
  const auto squares = [&](const Matrix6<Scalar>& L, const Matrix6<Scalar>& other) {
    return solve_lower<Scalar, 6, 6>(L, other).squaredNorm() + solve_lower<Scalar, 6, 1>(L, d).squaredNorm();
  };
  return std::max(Scalar(0), Scalar(0.5) * (squares(L_1, L_2) + squares(L_2, L_1)) - Scalar(6));
}

/// Mean and covariance of the mixture of two weighted Gaussians on one tangent space.
template <class Scalar>
[[nodiscard]] TangentGaussian<Scalar> merge(Scalar w_1, const TangentGaussian<Scalar>& y_1, Scalar w_2,
                                            const TangentGaussian<Scalar>& y_2) {
  const Scalar a = w_1 / (w_1 + w_2), b = w_2 / (w_1 + w_2);
  const Vector6<Scalar> d = y_2.mean - y_1.mean;
  TangentGaussian<Scalar> merged{y_1.mean + b * d, a * y_1.covariance + b * y_2.covariance};
  add_outer_product(a * b, d, d, merged.covariance);
  return merged;
}

/// Two components on the tangent space at their weighted mean rotation, and merged there.
template <class Scalar>
struct MergedPair {
  Vector4<Scalar> tangent_point;
  TangentGaussian<Scalar> first, second, merged;
  Scalar log_peak_1 = 0, log_peak_2 = 0;  ///< -log|S_i|/2 plus a constant

  template <Projection kProjection>
  MergedPair(Scalar w_1, const BasicProjectedGaussian<Scalar, kProjection>& p_1, Scalar w_2,
             const BasicProjectedGaussian<Scalar, kProjection>& p_2) {
    const Vector4<Scalar>&q_1 = p_1.tangent_point(), &q_2 = p_2.tangent_point();
    const Scalar sign = q_1.dot(q_2) < Scalar(0) ? Scalar(-1) : Scalar(1);
    tangent_point = (w_1 * q_1 + sign * w_2 * q_2).normalized();
    const ChartChange<Scalar> from_1(q_1, tangent_point), from_2(q_2, tangent_point);
    first = from_1.linearized(p_1.parameters());
    second = from_2.linearized(p_2.parameters());
    merged = merge(w_1, first, w_2, second);
    log_peak_1 = p_1.gaussian_log_peak() - from_1.log_determinant(p_1.mean().template head<3>());
    log_peak_2 = p_2.gaussian_log_peak() - from_2.log_determinant(p_2.mean().template head<3>());
  }
};

/// The cost of merging two components of regular covariances.
template <class Scalar>
[[nodiscard]] Scalar merge_cost(MergeCriterion criterion, Scalar w_1, Scalar w_2,
                                const MergedPair<Scalar>& pair) {
  constexpr Scalar kInfinity = std::numeric_limits<Scalar>::infinity();
  const auto L = cholesky_factor(pair.merged.covariance);
  if (!L) return kInfinity;
  if (criterion == MergeCriterion::kRunnalls) {
    const Scalar log_peak = gaussian_log_peak(*L);
    return std::max(Scalar(0), w_1 * (pair.log_peak_1 - log_peak) + w_2 * (pair.log_peak_2 - log_peak));
  }
  const auto L_1 = cholesky_factor(pair.first.covariance);
  const auto L_2 = cholesky_factor(pair.second.covariance);
  if (!L_1 || !L_2) return kInfinity;
  return w_1 * symmetric_kl<Scalar>(*L_1, *L, pair.merged.mean - pair.first.mean) +
         w_2 * symmetric_kl<Scalar>(*L, *L_2, pair.merged.mean - pair.second.mean);
}

/// The marginal of the translation, which does not depend on the tangent space.
template <class Scalar>
struct TranslationMarginal {
  Vector3<Scalar> mean;
  Matrix3<Scalar> covariance;
  Scalar log_determinant;

  template <Projection kProjection>
  explicit TranslationMarginal(const BasicProjectedGaussian<Scalar, kProjection>& p)
      : mean(p.mean().template tail<3>()),
        covariance(p.covariance().template bottomRightCorner<3, 3>()),
        log_determinant(std::log(covariance.determinant())) {}
};

/// A lower bound of merge_cost by either criterion: Runnalls' cost for the translations alone. A divergence
/// of marginals is never above that of the joint densities.
template <class Scalar>
[[nodiscard]] Scalar merge_cost_bound(Scalar w_1, const TranslationMarginal<Scalar>& p_1, Scalar w_2,
                                      const TranslationMarginal<Scalar>& p_2) {
  using std::log;
  const Scalar a = w_1 / (w_1 + w_2), b = w_2 / (w_1 + w_2);
  const Vector3<Scalar> d = p_2.mean - p_1.mean;
  Matrix3<Scalar> merged = a * p_1.covariance + b * p_2.covariance;
  add_outer_product(a * b, d, d, merged);
  const Scalar log_determinant = log(merged.determinant());
  return Scalar(0.5) *
         (w_1 * (log_determinant - p_1.log_determinant) + w_2 * (log_determinant - p_2.log_determinant));
}

}  // namespace detail

/// The symmetric Kullback-Leibler divergence (Jeffreys) of two densities, MPG Eq. (23), in nats, both
/// restated half way between their tangent points. Throws std::domain_error if a covariance is singular.
template <std::floating_point Scalar, Projection kProjection>
[[nodiscard]] Scalar symmetric_kl_divergence(const BasicProjectedGaussian<Scalar, kProjection>& a,
                                             const BasicProjectedGaussian<Scalar, kProjection>& b) {
  const detail::MergedPair<Scalar> pair(Scalar(0.5), a, Scalar(0.5), b);
  const auto L_a = detail::cholesky_factor(pair.first.covariance);
  const auto L_b = detail::cholesky_factor(pair.second.covariance);
  if (!L_a || !L_b) [[unlikely]] {
    throw std::domain_error("a projected Gaussian with a singular covariance has no divergences");
  }
  return detail::symmetric_kl<Scalar>(*L_a, *L_b, pair.second.mean - pair.first.mean);
}

/// The component with the moments of two weighted ones (the p' of MPG Eq. 24), centred at its mode.
template <std::floating_point Scalar, Projection kProjection>
[[nodiscard]] BasicProjectedGaussian<Scalar, kProjection> merge(
    Scalar w_1, const BasicProjectedGaussian<Scalar, kProjection>& p_1, Scalar w_2,
    const BasicProjectedGaussian<Scalar, kProjection>& p_2) {
  const detail::MergedPair<Scalar> pair(w_1, p_1, w_2, p_2);
  const auto y = detail::centered(pair.merged);
  return {detail::central_projection<Scalar>(pair.tangent_point, pair.merged.mean.template head<3>()), y.mean,
          y.covariance};
}

}  // namespace antipode
