// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include <antipode/detail/check.hpp>
#include <antipode/detail/products.hpp>
#include <antipode/detail/solve.hpp>
#include <antipode/detail/symmetric_eigen.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/filters/detail/mode_ascent.hpp>
#include <antipode/filters/detail/sqrt_gaussian.hpp>

namespace antipode::detail {

/// The search for a second mode of prior times likelihood, beside the one in which an update settled.
///
/// It evaluates the density on the straight lines through the posterior's mean along which the measurement
/// made the prior narrower, from two standard deviations of the posterior to three of the prior, in steps
/// that grow with the distance. `evaluate` sets the log-likelihoods at Count vectors about the posterior's
/// mean, one per column.
///
/// Either the density rises again on a line: then that rise is followed to its top. Or the second mode is
/// beside the line, as that of a planar pattern seen by one camera, whose two poses differ in the tilt and a
/// little in everything else. On the way there the density falls less than on the opposite side, or much less
/// than the posterior's covariance says: `starts` are such places, from where an ascent (ModeAscent) finds
/// the mode.
template <class Density, int Count, class Evaluate>
class ModeSearch {
  using Chart = typename Density::Chart;
  using Scalar = typename Density::Scalar;
  static constexpr int N = Chart::kDim;
  static constexpr int kPlaces = 8;  // on each half of a line, at least; more if lines are few
  static constexpr int kMostPlaces = std::max(kPlaces, (Count - 1) / 2);
  static_assert(Count > 2 * N);

 public:
  ModeSearch(const SqrtGaussian<Density>& prior, const SqrtGaussian<Density>& posterior, Evaluate& evaluate)
      : evaluate_(evaluate), mean_(posterior.whitened_mean) {
    const PriorUnits<Density> units(prior, posterior);
    prior_root_ = units.root;
    const auto eigen = symmetric_eigen<Scalar, N>(
        scaled_square<Scalar, N, N>(units.posterior_root, Vector<Scalar, N>::Ones()));
    directions_ = eigen.vectors;
    variances_ = eigen.values;
    while (lines_ < N && eigen.values[lines_] < kNarrow) ++lines_;
    places_ = std::max(kPlaces, (Count - 1) / (2 * std::max(1, lines_)));
    for (int i = 0; i < 2 * lines_; ++i) lengths_[static_cast<std::size_t>(i)] = length(i);
  }

  /// A place to ascend from, as a step from the posterior's mean in units of the prior, and how promising it
  /// is.
  struct Start {
    Scalar promise = 0;
    Vector<Scalar, N> step = Vector<Scalar, N>::Zero();
  };

  /// Whether the density rises on a line to a second mode that is not negligible beside the first. Otherwise
  /// starts() are set.
  [[nodiscard]] bool rises_again() {
    if (lines_ == 0 || !all_finite(directions_) || !all_finite(mean_)) return false;
    evaluate_lines();
    for (int i = 0; i < 2 * lines_; ++i) {
      const int k = highest_rise(i);
      if (k < 0) continue;
      const Scalar near = k > 0 ? place(i, k - 1) : Scalar(0);
      const Scalar far = place(i, std::min(k + 1, places_ - 1));
      if (rises_to_second_mode(i / 2, {near, place(i, k), far}, height(i, k))) return true;
    }
    for (int i = 0; i < 2 * lines_; ++i) add_starts(i);
    std::sort(starts_.begin(), starts_.begin() + static_cast<std::ptrdiff_t>(found_),
              [](const Start& a, const Start& b) {
                return a.promise != b.promise ? a.promise > b.promise
                                              : a.step.squaredNorm() < b.step.squaredNorm();
              });
    return false;
  }

  /// The number of starts, and the i-th most promising one.
  [[nodiscard]] std::size_t count() const { return found_; }
  [[nodiscard]] const Start& start(std::size_t i) const { return starts_[i]; }

  /// The number of lines, and their directions: unit vectors in units of the prior.
  [[nodiscard]] int lines() const { return lines_; }
  [[nodiscard]] Vector<Scalar, N> direction(int line) const { return directions_.col(line); }

  /// The log of prior times likelihood at the posterior's mean.
  [[nodiscard]] Scalar peak() const { return peak_; }

 private:
  static constexpr Scalar kNarrow{0.25};  // posterior over prior variance, below which a line is searched
  static constexpr Scalar kNear{2};       // standard deviations of the posterior
  static constexpr Scalar kSmallest = Scalar(1e-30);
  static constexpr Scalar kReach{3};  // standard deviations of the prior
  static constexpr Scalar kRise{1};   // a smaller rise of the log-density is no second mode
  static constexpr int kMostRefinements{6};
  static constexpr Scalar kApart{18};    // fall of the log-density by the covariance: six deviations
  static constexpr Scalar kSlowFall{3};  // how much slower than the covariance says
  static constexpr Scalar kOneSided = Scalar(1.3);  // how much slower than on the opposite side

  /// The k-th of the places on one half of a line, in standard deviations of the prior from the posterior's
  /// mean. They grow by a constant factor.
  [[nodiscard]] Scalar place(int half_line, int k) const {
    const Scalar sign = half_line % 2 == 0 ? Scalar(1) : Scalar(-1);
    const Scalar first = nearest(half_line / 2);
    const Scalar growth = lengths_[static_cast<std::size_t>(half_line)] / first;
    return sign * first * std::pow(growth, Scalar(k) / Scalar(places_ - 1));
  }
  [[nodiscard]] Scalar nearest(int line) const {
    return kNear * std::sqrt(std::max(variances_[line], kSmallest));
  }
  /// The distance of the last place: the same on both halves of a line, and inside the chart.
  [[nodiscard]] Scalar length(int half_line) const {
    constexpr int kMostShortenings = 16;
    const Vector<Scalar, N> direction = directions_.col(half_line / 2);
    const Scalar first = nearest(half_line / 2);
    Scalar last = std::max(first, kReach + std::abs(direction.dot(mean_)));
    for (int i = 0; i < kMostShortenings && !Chart::contains(prior_root_ * (last * direction)); ++i) {
      last = std::max(first, Scalar(0.8) * last);
    }
    return last;
  }

  [[nodiscard]] Scalar height(int half_line, int k) const { return heights_(half_line, k); }

  void evaluate_lines() {
    const int all = 2 * lines_ * places_;  // and the mean
    for (int first = 0; first <= all; first += Count) {
      Matrix<Scalar, 2, Count> where = Matrix<Scalar, 2, Count>::Zero();  // line and place
      for (int k = 0; k < Count && first + k < all; ++k) {
        const int half_line = (first + k) / places_;
        const int line = half_line / 2;
        where(0, k) = Scalar(line);
        where(1, k) = place(half_line, (first + k) % places_);
      }
      const Vector<Scalar, Count> values = log_density(where);
      for (int k = 0; k < Count && first + k < all; ++k) {
        heights_((first + k) / places_, (first + k) % places_) = values[k];
      }
      if (all - first < Count) peak_ = values[all - first];
    }
  }

  [[nodiscard]] Vector<Scalar, Count> log_density(const Matrix<Scalar, 2, Count>& where) {
    Matrix<Scalar, N, Count> tangents;
    Vector<Scalar, Count> values, from_prior;
    for (int k = 0; k < Count; ++k) {
      const int line = static_cast<int>(where(0, k));
      const Vector<Scalar, N> direction = directions_.col(line);
      Vector<Scalar, N> tangent = prior_root_ * (where(1, k) * direction);
      from_prior[k] = (mean_ + where(1, k) * direction).squaredNorm();
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
  [[nodiscard]] int highest_rise(int half_line) const {
    int highest = -1;
    Scalar low = peak_;
    for (int k = 0; k < places_; ++k) {
      const Scalar value = height(half_line, k);
      low = std::min(low, value);
      if (value > low + kRise && (highest < 0 || value > height(half_line, highest))) highest = k;
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
    for (int i = 0; i < kMostRefinements && top <= peak_ - kNegligibleFall<Scalar>; ++i) {
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
    return top > peak_ - kNegligibleFall<Scalar>;
  }

  /// Adds the most promising place of half a line, if it is promising at all, and the next farther one: the
  /// mode is beyond the place at which the line is closest to the way there.
  void add_starts(int half_line) {
    Scalar most(1);
    int best = -1;
    for (int k = 0; k < places_; ++k) {
      const Scalar promise = promise_of(half_line, k);
      if (promise > most) {
        most = promise;
        best = k;
      }
    }
    for (int k = best; best >= 0 && k < std::min(best + 2, places_); ++k) {
      starts_[found_++] = {most, place(half_line, k) * directions_.col(half_line / 2)};
    }
  }

  /// Above one if the density falls much less up to a place than the posterior's covariance says, or less
  /// than on the opposite side.
  [[nodiscard]] Scalar promise_of(int half_line, int k) const {
    constexpr Scalar kNoFall = Scalar(1e-3);
    const Scalar at = place(half_line, k);
    const Scalar expected = Scalar(0.5) * at * at / std::max(variances_[half_line / 2], kSmallest);
    if (expected < kApart) return Scalar(0);
    const Scalar fall = std::max(peak_ - height(half_line, k), kNoFall);
    const Scalar opposite = std::min(peak_ - height(half_line ^ 1, k), Scalar(100) * expected);
    return std::max(expected / (kSlowFall * fall), opposite / (kOneSided * fall));
  }

  Evaluate& evaluate_;
  Vector<Scalar, N> mean_;        ///< of the posterior, in whitened coordinates of the prior
  Matrix<Scalar, N> prior_root_;  ///< of the prior's covariance, about the posterior's mean
  Matrix<Scalar, N> directions_;  ///< unit columns in units of the prior, the narrowest first
  Vector<Scalar, N> variances_;   ///< of the posterior along them
  int lines_ = 0, places_ = 0;
  std::array<Scalar, std::size_t{2} * N> lengths_{};  ///< of the halves of the lines
  Matrix<Scalar, 2 * N, kMostPlaces> heights_;  ///< log of prior times likelihood, a row for half a line
  Scalar peak_ = Scalar(0);                     ///< the same at the posterior's mean
  std::array<Start, std::size_t{4} * N> starts_{};
  std::size_t found_ = 0;
};

/// Whether prior times likelihood has a second mode that is not negligible beside the posterior: one on a
/// line (ModeSearch), or one that an ascent finds (ModeAscent). Its evidence, which counts its width,
/// decides; where an ascent does not settle, its height.
///
/// The ascents start beside the lines. If the posterior does not explain the measurement, the right mode may
/// be anywhere: then they also start from places all over the prior.
template <int Count, class Density, class Evaluate, class Model>
[[nodiscard]] bool has_second_mode(const SqrtGaussian<Density>& prior, const SqrtGaussian<Density>& posterior,
                                   const SettledMode<typename Density::Scalar>& settled, Evaluate&& evaluate,
                                   Model&& local_model) {
  using Scalar = typename Density::Scalar;
  using Tangent = typename SqrtGaussian<Density>::Tangent;
  constexpr std::size_t kMostAscents = 6;
  constexpr Scalar kWithinPrior{2};  // standard deviations
  ModeSearch<Density, Count, Evaluate> search(prior, posterior, evaluate);
  if (search.rises_again()) return true;
  const ModeAscent<Density, Model> ascent(prior, posterior, search.peak(), local_model);
  const auto finds_mode = [&](const AscentEnd<Scalar>& end) {
    const bool in_mode = end.log_evidence > AscentEnd<Scalar>::kNowhere;
    return end.beyond_covariance ||
           (in_mode ? end.log_evidence > settled.log_evidence - kNegligibleFall<Scalar>
                    : end.log_density > search.peak() - kNegligibleFall<Scalar>);
  };
  for (std::size_t i = 0; i < std::min(search.count(), kMostAscents); ++i) {
    if (finds_mode(ascent.from(search.start(i).step))) return true;
  }
  if (search.peak() >= settled.least_log_density) return false;
  for (int i = 0; i < 2 * search.lines(); ++i) {
    const Tangent y = (i % 2 == 0 ? kWithinPrior : -kWithinPrior) * search.direction(i / 2);
    if (finds_mode(ascent.from_prior(y))) return true;
  }
  return false;
}

}  // namespace antipode::detail
