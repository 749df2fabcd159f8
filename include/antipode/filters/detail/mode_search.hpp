// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include <antipode/detail/products.hpp>
#include <antipode/detail/solve.hpp>
#include <antipode/detail/symmetric_eigen.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/filters/detail/sqrt_gaussian.hpp>

namespace antipode::detail {

/// The search for a second mode of prior times likelihood, beside the one in which an update settled.
///
/// It follows the straight lines through the posterior's mean along which the measurement made the prior
/// narrower, from two standard deviations of the posterior to three of the prior: first in steps that grow
/// with the distance, then with all points where the density rises again. A mode that is not on such a line
/// is not found. The two modes of an ambiguous single sensor are on one. `evaluate` sets the log-likelihoods
/// at Count vectors about the posterior's mean, one per column.
template <class Density, int Count, class Evaluate>
class ModeSearch {
  using Chart = typename Density::Chart;
  using Scalar = typename Density::Scalar;
  static constexpr int N = Chart::kDim;
  static_assert(Count > 2 * N);

 public:
  ModeSearch(const SqrtGaussian<Density>& prior, const SqrtGaussian<Density>& posterior, Evaluate& evaluate)
      : evaluate_(evaluate) {
    mean_ = posterior.whitened_mean;
    prior_root_ = Chart::jacobian(prior.L * mean_) * prior.L;
    const auto eigen = symmetric_eigen<Scalar, N>(
        scaled_square<Scalar, N, N>(posterior.whitened_root, Vector<Scalar, N>::Ones()));
    directions_ = eigen.vectors;
    variances_ = eigen.values;
    while (lines_ < N && eigen.values[lines_] < kNarrow) ++lines_;
  }

  /// Whether there is a second mode that is not negligible beside the first.
  [[nodiscard]] bool finds_second_mode() {
    if (lines_ == 0 || !all_finite(directions_) || !all_finite(mean_)) return false;
    const int half = (Count - 1) / (2 * lines_);                        // of a line
    Matrix<Scalar, 2, Count> where = Matrix<Scalar, 2, Count>::Zero();  // line and place; last, the mean
    for (int i = 0; i < 2 * lines_; ++i) {
      const int line = i / 2;
      for (int k = 0; k < half; ++k) {
        where(0, i * half + k) = Scalar(line);
        where(1, i * half + k) = place(i, k, half);
      }
    }
    const Vector<Scalar, Count> values = log_density(where);
    peak_ = values[Count - 1];
    for (int i = 0; i < 2 * lines_; ++i) {
      const int k = highest_rise(values.data() + i * half, half);
      if (k < 0) continue;
      const Scalar near = k > 0 ? place(i, k - 1, half) : Scalar(0);
      const Scalar far = place(i, std::min(k + 1, half - 1), half);
      if (rises_to_second_mode(i / 2, {near, place(i, k, half), far}, values[i * half + k])) return true;
    }
    return false;
  }

 private:
  static constexpr Scalar kNarrow{0.25};  // posterior over prior variance, below which a line is searched
  static constexpr Scalar kNear{2};       // standard deviations of the posterior
  static constexpr Scalar kSmallest = Scalar(1e-30);
  static constexpr Scalar kReach{3};       // standard deviations of the prior
  static constexpr Scalar kRise{1};        // a smaller rise of the log-density is no second mode
  static constexpr Scalar kNegligible{6};  // a mode lower by this has little weight
  static constexpr int kMostRefinements{6};

  /// The k-th of the places on one half of a line, in standard deviations of the prior from the posterior's
  /// mean. They grow by a constant factor.
  [[nodiscard]] Scalar place(int half_line, int k, int places) const {
    const int line = half_line / 2;
    const Scalar sign = half_line % 2 == 0 ? Scalar(1) : Scalar(-1);
    const Scalar first = kNear * std::sqrt(std::max(variances_[line], kSmallest));
    const Vector<Scalar, N> direction = directions_.col(line);
    const Scalar last = std::max(first, kReach - sign * direction.dot(mean_));
    return sign * first * std::pow(last / first, Scalar(k) / Scalar(std::max(1, places - 1)));
  }

  [[nodiscard]] Vector<Scalar, Count> log_density(const Matrix<Scalar, 2, Count>& where) {
    Matrix<Scalar, N, Count> tangents;
    Vector<Scalar, Count> values, from_prior;
    for (int k = 0; k < Count; ++k) {
      const int line = static_cast<int>(where(0, k));
      Vector<Scalar, N> step, whitened;
      for (int i = 0; i < N; ++i) {
        step[i] = where(1, k) * directions_(i, line);
        whitened[i] = mean_[i] + step[i];
      }
      Vector<Scalar, N> tangent = prior_root_ * step;
      from_prior[k] = whitened.squaredNorm();
      // No chart reaches beyond that, and the prior has no weight there.
      if (!std::isfinite(tangent.squaredNorm())) {
        tangent.setZero();
        from_prior[k] = std::numeric_limits<Scalar>::infinity();
      }
      tangents.col(k) = tangent;
    }
    evaluate_(tangents, values);
    for (int k = 0; k < Count; ++k) {
      values[k] -= Scalar(0.5) * from_prior[k];
      if (std::isnan(values[k])) values[k] = -std::numeric_limits<Scalar>::infinity();
    }
    return values;
  }

  /// The index of the highest of those places on half a line at which the density, seen from the mean, has
  /// risen again; -1 if it only falls.
  [[nodiscard]] int highest_rise(const Scalar* values, int places) const {
    int highest = -1;
    Scalar low = peak_;
    for (int k = 0; k < places; ++k) {
      low = std::min(low, values[k]);
      if (values[k] > low + kRise && (highest < 0 || values[k] > values[highest])) highest = k;
    }
    return highest;
  }

  /// An interval of places on a line, and the highest place in it.
  struct Rise {
    Scalar begin, highest, end;
  };

  /// Follows a rise to its top. Each finer grid is centred at the highest place found so far, as all places
  /// of that grid may be lower.
  [[nodiscard]] bool rises_to_second_mode(int line, Rise rise, Scalar top) {
    for (int i = 0; i < kMostRefinements && top <= peak_ - kNegligible; ++i) {
      const Scalar step = (rise.end - rise.begin) / Scalar(Count - 1);
      Matrix<Scalar, 2, Count> where;
      for (int k = 0; k < Count; ++k) {
        where(0, k) = Scalar(line);
        where(1, k) = rise.begin + Scalar(k) * step;
      }
      const Vector<Scalar, Count> found = log_density(where);
      for (int k = 0; k < Count; ++k) {
        if (!(found[k] > top)) continue;
        top = found[k];
        rise.highest = where(1, k);
      }
      rise.begin = rise.highest - step;
      rise.end = rise.highest + step;
    }
    return top > peak_ - kNegligible;
  }

  Evaluate& evaluate_;
  Matrix<Scalar, N> prior_root_;  ///< of the prior's covariance, about the posterior's mean
  Vector<Scalar, N> mean_;        ///< of the posterior, in whitened coordinates of the prior
  Matrix<Scalar, N> directions_;  ///< unit columns in these coordinates, the narrowest first
  Vector<Scalar, N> variances_;   ///< of the posterior along them
  int lines_ = 0;
  Scalar peak_ = Scalar(0);  ///< log of prior times likelihood at the posterior's mean
};

/// Whether prior times likelihood has a second mode: see ModeSearch.
template <int Count, class Density, class Evaluate>
[[nodiscard]] bool has_second_mode(const SqrtGaussian<Density>& prior, const SqrtGaussian<Density>& posterior,
                                   Evaluate&& evaluate) {
  return ModeSearch<Density, Count, Evaluate>(prior, posterior, evaluate).finds_second_mode();
}

}  // namespace antipode::detail
