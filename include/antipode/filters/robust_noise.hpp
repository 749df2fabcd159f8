// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>
#include <limits>
#include <numbers>

#include <antipode/detail/check.hpp>

/// @file
/// Kinds of noise with heavier tails than the Gaussian, for data with outliers, as functions of the squared
/// Mahalanobis distance d^2 of a measurement from its prediction. RobustMeasurements uses their
/// log-densities, robust_least_squares() their weights.
namespace antipode {

/// Gaussian noise with the covariance R: every measurement has the weight 1.
template <std::floating_point Scalar>
struct NormalNoise {
  /// Does nothing: there are no parameters.
  void check() const {}
  /// -d^2/2.
  [[nodiscard]] Scalar log_density(Scalar squared_distance, int /*dim*/) const {
    return Scalar(-0.5) * squared_distance;
  }
  /// 1.
  [[nodiscard]] Scalar weight(Scalar /*squared_distance*/, int /*dim*/) const { return Scalar(1); }
  /// 0.
  [[nodiscard]] Scalar weight_slope(Scalar /*squared_distance*/, int /*dim*/) const { return Scalar(0); }
};

/// Truncated least squares, -min(d^2, cap)/2: a measurement counts fully, or beyond the cap not at all. An
/// M-estimator with a jump in its weights, so that the steps may end between two sets of measurements.
template <std::floating_point Scalar>
struct TruncatedLoss {
  Scalar cap = Scalar(16);  ///< on the squared distance

  /// Throws unless the cap is positive.
  void check() const {
    if (!(cap > Scalar(0))) [[unlikely]]
      detail::throw_invalid("cap of TruncatedLoss is not positive", cap);
  }
  /// Minus the loss.
  [[nodiscard]] Scalar log_density(Scalar squared_distance, int /*dim*/) const {
    return Scalar(-0.5) * std::min(squared_distance, cap);
  }
  /// 1 below the cap, and 0 from there on.
  [[nodiscard]] Scalar weight(Scalar squared_distance, int /*dim*/) const {
    return squared_distance < cap ? Scalar(1) : Scalar(0);
  }
  /// 0.
  [[nodiscard]] Scalar weight_slope(Scalar /*squared_distance*/, int /*dim*/) const { return Scalar(0); }
};

/// Cauchy's loss, -scale^2/2 log(1 + d^2/scale^2): an M-estimator rather than a density. A measurement
/// without residual has the weight 1, as with normal noise, and one at the distance `scale` half of that.
template <std::floating_point Scalar>
struct CauchyLoss {
  Scalar scale = Scalar(2.4);  ///< in standard deviations of the noise

  /// Throws unless the scale is positive and finite.
  void check() const {
    if (!(scale > Scalar(0)) || !std::isfinite(scale)) [[unlikely]]
      detail::throw_invalid("scale of CauchyLoss is not positive", scale);
  }
  /// Minus the loss. Finite at any distance, infinity too.
  [[nodiscard]] Scalar log_density(Scalar squared_distance, int /*dim*/) const {
    const Scalar ratio = std::min(squared_distance / (scale * scale), std::numeric_limits<Scalar>::max());
    return Scalar(-0.5) * scale * scale * std::log1p(ratio);
  }
  /// 1 / (1 + d^2 / scale^2).
  [[nodiscard]] Scalar weight(Scalar squared_distance, int /*dim*/) const {
    return Scalar(1) / (Scalar(1) + squared_distance / (scale * scale));
  }
  /// The derivative of the weight by d^2.
  [[nodiscard]] Scalar weight_slope(Scalar squared_distance, int dim) const {
    const Scalar w = weight(squared_distance, dim);
    return -w * w / (scale * scale);
  }
};

/// The multivariate t distribution with the scale matrix R, without constants:
/// -(dof + Dim)/2 log(1 + d^2/dof).
///
/// The default choice: it needs no share of outliers, and its gradient points towards the mode from any
/// distance. In return, good measurements count a little less than they should (3 to 9 % larger errors). A
/// dof of 1 is the Cauchy distribution; above 30 it is nearly Gaussian.
template <std::floating_point Scalar>
struct StudentT {
  Scalar dof = Scalar(4);  ///< degrees of freedom

  /// Throws unless dof is positive and finite.
  void check() const {
    if (!(dof > Scalar(0)) || !std::isfinite(dof)) [[unlikely]]
      detail::throw_invalid("dof of StudentT is not positive", dof);
  }
  /// The logarithm, without constants, at a squared Mahalanobis distance of a vector of `dim` numbers. Finite
  /// at any distance, infinity too.
  [[nodiscard]] Scalar log_density(Scalar squared_distance, int dim) const {
    const Scalar ratio = std::min(squared_distance / dof, std::numeric_limits<Scalar>::max());
    return Scalar(-0.5) * (dof + Scalar(dim)) * std::log1p(ratio);
  }
  /// (dof + dim) / (dof + d^2).
  [[nodiscard]] Scalar weight(Scalar squared_distance, int dim) const {
    return (dof + Scalar(dim)) / (dof + squared_distance);
  }
  /// The derivative of the weight by d^2.
  [[nodiscard]] Scalar weight_slope(Scalar squared_distance, int dim) const {
    return -weight(squared_distance, dim) / (dof + squared_distance);
  }
};

/// A share of the measurements are outliers, the others Gaussian, without constants:
///
///     log((1 - share) exp(-d^2/2) + share scale^-Dim t(d/scale)) - log(1 - share)
///
/// with t the density of the Cauchy distribution divided by the peak of the Gaussian: outliers scatter about
/// the prediction too, `outlier_scale` times as far. This is the contamination model of Tukey (1960) and
/// Huber (1964). Good measurements count fully and outliers hardly at all, so that the update is about as
/// good as one that knows the outliers. If measurements are few, the posterior has more than one mode, and an
/// update from a wide prior may not settle on one; the status reports this. A larger scale makes outliers
/// count less and the modes harder to find.
template <std::floating_point Scalar>
struct Contamination {
  Scalar outlier_share = Scalar(0.2);  ///< of all measurements, inside (0, 1)
  Scalar outlier_scale = Scalar(5);    ///< in standard deviations of the noise

  /// Throws unless the share is in (0, 1) and the scale at least 1.
  void check() const {
    if (!(outlier_share > Scalar(0) && outlier_share < Scalar(1))) [[unlikely]] {
      detail::throw_invalid("outlier_share of Contamination is not in (0, 1)", outlier_share);
    }
    if (!(outlier_scale >= Scalar(1)) || !std::isfinite(outlier_scale)) [[unlikely]] {
      detail::throw_invalid("outlier_scale of Contamination is below 1", outlier_scale);
    }
  }
  /// The logarithm, without constants, at a squared Mahalanobis distance of a vector of `dim` numbers. Finite
  /// at any distance, infinity too.
  [[nodiscard]] Scalar log_density(Scalar squared_distance, int dim) const {
    using std::exp;
    using std::log;
    using std::log1p;
    squared_distance = std::min(squared_distance, std::numeric_limits<Scalar>::max());
    const Scalar outlier = log_outlier(squared_distance, dim);
    const Scalar good = Scalar(-0.5) * squared_distance;
    return good > outlier ? good + log1p(exp(outlier - good)) : outlier + log1p(exp(good - outlier));
  }
  /// That of a good measurement is 1, that of an outlier (1 + dim) / (scale^2 + d^2): the mean of both, by
  /// their probabilities.
  [[nodiscard]] Scalar weight(Scalar squared_distance, int dim) const {
    const Scalar p = outlier_probability(squared_distance, dim);
    return (Scalar(1) - p) + p * outlier_weight(squared_distance, dim);
  }
  /// The derivative of the weight by d^2.
  [[nodiscard]] Scalar weight_slope(Scalar squared_distance, int dim) const {
    const Scalar p = outlier_probability(squared_distance, dim);
    const Scalar w = outlier_weight(squared_distance, dim);
    return Scalar(-0.5) * p * (Scalar(1) - p) * (Scalar(1) - w) * (Scalar(1) - w) -
           p * w / (outlier_scale * outlier_scale + squared_distance);
  }

 private:
  [[nodiscard]] Scalar log_outlier(Scalar squared_distance, int dim) const {
    const Scalar ratio = squared_distance / (outlier_scale * outlier_scale);
    return log_outlier_peak(dim) - Scalar(0.5) * Scalar(1 + dim) * std::log1p(ratio);
  }
  [[nodiscard]] Scalar outlier_weight(Scalar squared_distance, int dim) const {
    return Scalar(1 + dim) / (outlier_scale * outlier_scale + squared_distance);
  }
  /// Of a measurement at this distance.
  [[nodiscard]] Scalar outlier_probability(Scalar squared_distance, int dim) const {
    const Scalar log_odds = log_outlier(squared_distance, dim) + Scalar(0.5) * squared_distance;
    return Scalar(1) / (Scalar(1) + std::exp(-log_odds));
  }
  /// log of share/(1 - share) times the Cauchy density's peak in units of the Gaussian's,
  /// 2^(Dim/2) Gamma((1 + Dim)/2) / Gamma(1/2), which is 1 for Dim = 2, and (Dim - 1) times that of Dim - 2.
  [[nodiscard]] Scalar log_outlier_peak(int dim) const {
    using std::log;
    Scalar ratio = dim % 2 == 0 ? Scalar(1) : Scalar(2) / std::sqrt(Scalar(2) * std::numbers::pi_v<Scalar>);
    for (int d = dim; d > 2; d -= 2) ratio *= Scalar(d - 1);
    return log(outlier_share / (Scalar(1) - outlier_share) * ratio) - Scalar(dim) * log(outlier_scale);
  }
};

/// A robust kind of noise. log_density(d^2, dim) is finite for a finite d^2 and at most log_density(0, dim);
/// check() throws on invalid parameters.
template <class Noise, class Scalar>
concept RobustNoise = requires(const Noise& noise, Scalar squared_distance) {
  { noise.log_density(squared_distance, 3) } -> std::same_as<Scalar>;
  noise.check();
};

/// A robust kind of noise that gives measurements weights for least squares. weight(d^2, dim) is -2 times the
/// derivative of log_density by d^2, and never negative; weight_slope(d^2, dim) is the derivative of the
/// weight by d^2.
template <class Noise, class Scalar>
concept WeightedNoise = RobustNoise<Noise, Scalar> && requires(const Noise& noise, Scalar squared_distance) {
  { noise.weight(squared_distance, 3) } -> std::same_as<Scalar>;
  { noise.weight_slope(squared_distance, 3) } -> std::same_as<Scalar>;
};

}  // namespace antipode
