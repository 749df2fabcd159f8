// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>
#include <limits>
#include <numbers>

#include <antipode/cubature/gaussian_rules.hpp>
#include <antipode/detail/check.hpp>
#include <antipode/detail/products.hpp>
#include <antipode/detail/symmetric_eigen.hpp>
#include <antipode/distributions/bingham.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/weighted_samples.hpp>

/// @file
/// Deterministic samples of a Bingham density. Every rule reproduces the scatter matrix E[x x^T] exactly: a
/// fit to the samples gives the density back. One point stands for each antipodal pair, so that only
/// statistics that ignore the sign of x have a meaning.
namespace antipode {

/// Gnomonic samples from any symmetric rule {g_k, c_k} of the Gaussian on the tangent space at the mode.
///
///     y_k = (sqrt(omega_i) g_ki, i < Dim;  sqrt(omega_Dim)),   x_k = M y_k/|y_k|,   weight c_k |y_k|^2
///
/// The weight undoes the normalisation, hence the scatter sum_k c_k M y_k y_k^T M^T = M diag(omega) M^T: in
/// closed form and with positive weights for every concentration, the uniform density included. Where the
/// density is concentrated, all moments that the cubature integrates are right as well.
template <GaussianRule Cubature>
struct GnomonicRule {
  static constexpr int kDim = Cubature::kDim + 1;  ///< of the points
  static constexpr int kCount = Cubature::kCount;  ///< number of points

  Cubature cubature{};  ///< the rule on the tangent space
};

/// 15 points on S^3: the default of the filters.
using BinghamGnomonicRule = GnomonicRule<Degree5Rule<3>>;

namespace detail {

/// (spread_i g_i, i < Dim; spread_Dim): a point of the tangent space at the mode, in homogeneous coordinates.
template <class Scalar, int Dim>
[[nodiscard]] Vector<Scalar, Dim> tangent_point(const Vector<Scalar, Dim>& spread,
                                                const Vector<Scalar, Dim - 1>& g) {
  Vector<Scalar, Dim> y = spread;
  for (int i = 0; i + 1 < Dim; ++i) y[i] *= g[i];
  return y;
}

}  // namespace detail

/// The points of the rule, as columns, and their weights. The scatter matrix is exact.
template <GaussianRule Cubature, std::floating_point Scalar>
[[nodiscard]] WeightedSamples<Scalar, Cubature::kDim + 1, Cubature::kCount> sample(
    const GnomonicRule<Cubature>& rule, const Bingham<Scalar, Cubature::kDim + 1>& bingham) {
  using std::sqrt;
  constexpr int kDim = Cubature::kDim + 1;
  const auto standard = rule.cubature.template standard<Scalar>();
  const Vector<Scalar, kDim> spread = bingham.second_moments().cwiseSqrt();
  WeightedSamples<Scalar, kDim, Cubature::kCount> samples;
  for (int k = 0; k < samples.size(); ++k) {
    const Vector<Scalar, kDim> y = detail::tangent_point<Scalar, kDim>(spread, standard.points.col(k));
    const Scalar square = y.squaredNorm();
    const Vector<Scalar, kDim> x = bingham.axes() * y;
    samples.points.col(k) = x / sqrt(square);
    samples.weights[k] = standard.weights[k] * square;
  }
  return samples;
}

/// The 2 Dim - 1 points of the base scheme (7 on S^3): the mode with weight lambda omega_Dim and a symmetric
/// pair on the great circle from the mode to each other axis. It is the gnomonic rule of the unscented
/// points.
///
/// lambda, 0 <= lambda <= 0.95, trades the weight of the mode against the angle of the pairs. The fourth
/// moments are wrong: 3/(1 - lambda) squared variances on each axis instead of 3, and zero for mixed ones.
/// References: Gilitschenski et al., "Unscented orientation estimation based on the Bingham distribution",
/// 2016; DQV-SLAM sec. III-C.
struct BinghamBaseRule {
  static constexpr int kDim = 4;    ///< of the points, for orientations; sample() takes any dimension
  static constexpr int kCount = 7;  ///< number of points

  double lambda = 0.5;  ///< weight of the mode, as a share of its second moment
};

/// The points of the rule, as columns, and their weights, in any dimension. Throws unless 0 <= lambda <=
/// 0.95.
template <std::floating_point Scalar, int Dim>
[[nodiscard]] WeightedSamples<Scalar, Dim, 2 * Dim - 1> sample(const BinghamBaseRule& rule,
                                                               const Bingham<Scalar, Dim>& bingham) {
  if (!(rule.lambda >= 0.0 && rule.lambda <= 0.95)) [[unlikely]] {
    detail::throw_invalid("lambda of the Bingham base rule is not in [0, 0.95]", rule.lambda);
  }
  const double kappa = (Dim - 1) * rule.lambda / (1.0 - rule.lambda);
  return sample(GnomonicRule<UnscentedRule<Dim - 1>>{{.kappa = kappa}}, bingham);
}

/// Equally weighted samples: the points of a rule laid out by the exponential map at the mode, then moved by
///
///     x <- A x / |A x|,   A = S^(1/2) (S^(-1/2) T S^(-1/2))^(-1/2) S^(-1/2),   T = scatter of the samples,
///
/// until their scatter T is that of the density, S. A dozen points need 2 to 9 steps where the density is
/// concentrated, up to some 65 where it is dispersed. Few points cannot match every dispersed density with
/// equal weights; the samples are then those of GnomonicRule, as their weights show.
template <GaussianRule Cubature>
struct EqualWeightRule {
  static constexpr int kDim = Cubature::kDim + 1;  ///< of the points
  static constexpr int kCount = Cubature::kCount;  ///< number of points

  Cubature cubature{};       ///< the rule on the tangent space
  int max_iterations = 200;  ///< most steps before the points of GnomonicRule are taken
};

namespace detail {

/// exp_mode(sqrt(omega) g) in the eigenbasis, with the angle limited to pi/2.
template <class Scalar, int Dim, int Count>
[[nodiscard]] Matrix<Scalar, Dim, Count> exponential_layout(const Vector<Scalar, Dim>& omega,
                                                            const Matrix<Scalar, Dim - 1, Count>& standard) {
  using std::cos;
  using std::sin;
  const Vector<Scalar, Dim - 1> spread = omega.template head<Dim - 1>().cwiseSqrt();
  Matrix<Scalar, Dim, Count> points;
  for (int k = 0; k < Count; ++k) {
    const Vector<Scalar, Dim - 1> tangent = spread.cwiseProduct(standard.col(k));
    const Scalar angle = std::min(tangent.norm(), Scalar(0.5) * std::numbers::pi_v<Scalar>);
    points.col(k) << sin(angle) * tangent.stableNormalized(), cos(angle);
  }
  return points;
}

}  // namespace detail

/// The points of the rule, as columns, and their weights, which are equal unless the steps did not settle.
template <GaussianRule Cubature, std::floating_point Scalar>
[[nodiscard]] WeightedSamples<Scalar, Cubature::kDim + 1, Cubature::kCount> sample(
    const EqualWeightRule<Cubature>& rule, const Bingham<Scalar, Cubature::kDim + 1>& bingham) {
  constexpr int kDim = Cubature::kDim + 1, kCount = Cubature::kCount;
  constexpr Scalar kTolerance = Scalar(256) * std::numeric_limits<Scalar>::epsilon();
  const Vector<Scalar, kDim> root = bingham.second_moments().cwiseSqrt();
  const Vector<Scalar, kDim> inverse_root = root.cwiseInverse();
  WeightedSamples<Scalar, kDim, kCount> samples;
  samples.weights.setConstant(Scalar(1) / Scalar(kCount));
  samples.points = detail::exponential_layout<Scalar, kDim, kCount>(
      bingham.second_moments(), rule.cubature.template standard<Scalar>().points);
  for (int iteration = 0; iteration < rule.max_iterations; ++iteration) {
    Matrix<Scalar, kDim> E = Matrix<Scalar, kDim>::Zero();
    for (int k = 0; k < kCount; ++k) {
      const Vector<Scalar, kDim> y = inverse_root.cwiseProduct(samples.points.col(k));
      detail::add_outer_product(Scalar(1) / Scalar(kCount), y, y, E);
    }
    if ((E - Matrix<Scalar, kDim>::Identity()).cwiseAbs().maxCoeff() < kTolerance) {
      for (int k = 0; k < kCount; ++k) {
        const Vector<Scalar, kDim> x = samples.points.col(k);
        samples.points.col(k) = bingham.axes() * x;
      }
      return samples;
    }
    const auto eigen = detail::symmetric_eigen(E);
    if (!(eigen.values[0] > Scalar(0))) break;
    Matrix<Scalar, kDim> A =
        detail::scaled_square<Scalar, kDim, kDim>(eigen.vectors, eigen.values.cwiseSqrt().cwiseInverse());
    for (int i = 0; i < kDim; ++i) {
      for (int j = 0; j < kDim; ++j) A(i, j) *= root[i] * inverse_root[j];
    }
    for (int k = 0; k < kCount; ++k) {
      const Vector<Scalar, kDim> x = samples.points.col(k);
      const Vector<Scalar, kDim> moved = A * x;
      samples.points.col(k) = moved.normalized();
    }
  }
  return sample(GnomonicRule<Cubature>{rule.cubature}, bingham);
}

}  // namespace antipode
