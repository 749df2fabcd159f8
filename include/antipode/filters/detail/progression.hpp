// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include <antipode/eigen_types.hpp>

/// The steps of a progression, which applies a likelihood in powers that add up to one.
namespace antipode::detail {

/// A remaining power of the likelihood below this counts as zero.
inline constexpr double kProgressionDone = 1e-12;

/// The extremes of the log-likelihoods of the samples that count.
template <class Scalar>
struct LogRange {
  Scalar lo = std::numeric_limits<Scalar>::infinity();
  Scalar hi = -std::numeric_limits<Scalar>::infinity();

  /// No value was NaN or +infinity.
  bool valid = true;

  /// Some sample explains the measurement.
  [[nodiscard]] bool supported() const { return hi > -std::numeric_limits<Scalar>::infinity(); }
};

/// The range of the log-likelihoods, which are made finite: -infinity becomes hi - 700 (e^-700 times less
/// likely than the best sample), or the least finite value if that is lower. Samples without weight do not
/// count; their values become hi.
template <class Scalar, int Count>
[[nodiscard]] LogRange<Scalar> bound_log_likelihoods(const Vector<Scalar, Count>& weights,
                                                     Vector<Scalar, Count>& values) {
  constexpr Scalar kInfinity = std::numeric_limits<Scalar>::infinity();
  constexpr Scalar kSpanOfImpossible = Scalar(700);
  LogRange<Scalar> range;
  for (int k = 0; k < Count; ++k) {
    if (!(weights[k] > Scalar(0))) continue;
    range.valid = range.valid && values[k] < kInfinity;
    range.hi = std::max(range.hi, values[k]);
    if (values[k] > -kInfinity) range.lo = std::min(range.lo, values[k]);
  }
  const Scalar impossible = std::min(range.lo, range.hi - kSpanOfImpossible);
  for (int k = 0; k < Count; ++k) {
    if (!(weights[k] > Scalar(0))) {
      values[k] = range.hi;
    } else if (!(values[k] > -kInfinity)) {
      values[k] = impossible;
    }
    range.lo = std::min(range.lo, values[k]);
  }
  return range;
}

/// A share of the likelihood to apply.
template <class Scalar>
struct ProgressionStep {
  Scalar size;
  bool floored;  ///< the step is longer than wanted
};

/// The wanted step, but at least min_step and at most what remains. In the second half of max_steps it is
/// also at least an even share of what remains, so that the last step takes all of it.
template <class Scalar>
[[nodiscard]] ProgressionStep<Scalar> progression_step(Scalar remaining, Scalar wanted, Scalar min_step,
                                                       int steps, int max_steps) {
  const Scalar share = steps < max_steps / 2 ? Scalar(0) : remaining / Scalar(max_steps - steps);
  const Scalar floor = std::min(remaining, std::max(min_step, share));
  return {std::min(remaining, std::max(wanted, floor)), wanted < floor};
}

/// The step within which no two samples' likelihoods change by more than 1 : tau relative to each other
/// (DQV-SLAM Alg. 2 line 8).
template <class Scalar>
[[nodiscard]] Scalar reweighting_step(const LogRange<Scalar>& range, Scalar tau) {
  using std::log;
  constexpr Scalar kFlat = Scalar(1e-12);
  const Scalar span = range.hi - range.lo;
  return span <= kFlat ? Scalar(1) : -log(tau) / span;
}

/// The power that a log-likelihood is raised to.
template <class Scalar>
struct ProgressionPower {
  Scalar power;
  bool forced;  ///< the power is larger than wanted
};

/// The wanted power, but at most one and at least the last one. In the second half of max_steps it grows at
/// least evenly, so that the last step applies all of the likelihood.
template <class Scalar>
[[nodiscard]] ProgressionPower<Scalar> next_power(Scalar last, Scalar wanted, int steps, int max_steps) {
  const int left = max_steps - steps;
  const Scalar floor = steps < max_steps / 2 ? last : last + (Scalar(1) - last) / Scalar(std::max(1, left));
  const Scalar least = left <= 1 ? Scalar(1) : floor;
  return {std::min(Scalar(1), std::max(wanted, least)), wanted < least && least > last};
}

/// Statistics of a reweighting.
template <class Scalar>
struct Reweighting {
  Scalar log_mean;               ///< log sum_k w_k r_k, of the factors r_k
  Scalar effective_sample_size;  ///< Count (sum_k w_k r_k)^2 / sum_k w_k r_k^2
};

/// w_k <- w_k exp(step l_k), normalised (the paper's Alg. 2 does not normalise the weights before it matches
/// the moments).
template <class Scalar, int Count>
Reweighting<Scalar> reweight(Scalar step, const Vector<Scalar, Count>& values,
                             Vector<Scalar, Count>& weights) {
  using std::log;
  const Scalar hi = values.maxCoeff();
  const Vector<Scalar, Count> factors = (step * (values.array() - hi)).exp();
  const Scalar mean_square = weights.dot(factors.cwiseAbs2()) / weights.sum();
  weights = weights.cwiseProduct(factors) / weights.sum();
  const Scalar mean = weights.sum();
  weights /= mean;
  return {step * hi + log(mean), Scalar(Count) * mean * mean / mean_square};
}

}  // namespace antipode::detail
