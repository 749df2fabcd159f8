// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <limits>
#include <optional>

#include <antipode/detail/check.hpp>
#include <antipode/detail/solve.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/filters/detail/quadratic_step.hpp>
#include <antipode/filters/detail/sqrt_gaussian.hpp>

namespace antipode::detail {

/// Units of the prior about the posterior's mean: the vector from there is root times the step in these
/// units. They are those of the prior's covariance. If that is singular, the prior's whitened coordinates
/// serve, which are bent where the posterior's mean is far from the prior's.
template <class Density>
struct PriorUnits {
  using Scalar = typename Density::Scalar;
  static constexpr int N = Density::Chart::kDim;

  Matrix<Scalar, N> root;
  Matrix<Scalar, N> posterior_root;  ///< of the posterior's covariance, in these units
  bool regular;                      ///< the prior's covariance

  PriorUnits(const SqrtGaussian<Density>& prior, const SqrtGaussian<Density>& posterior)
      : root(prior.L),
        posterior_root(solve<Scalar, N, N>(prior.L, posterior.L)),
        regular(all_finite(posterior_root)) {
    if (regular) return;
    root = Density::Chart::jacobian(prior.L * posterior.whitened_mean) * prior.L;
    posterior_root = posterior.whitened_root;
  }
};

/// A log-likelihood to second order over a density, in the density's coordinates, and its value at the mean.
template <class Scalar, int N>
struct LocalModel {
  QuadraticLogLikelihood<Scalar, N> model;
  Scalar log_likelihood;
};

/// e^-6, one of 400: the weight below which a second mode is negligible, as a fall of the log-density.
template <class Scalar>
inline constexpr Scalar kNegligibleFall{6};

/// What is known of the mode in which an update settled.
template <class Scalar>
struct SettledMode {
  Scalar log_evidence;
  /// The log of prior times likelihood that a mode which explains the measurement has at least, all but one
  /// time in a hundred; -infinity if the likelihood has unknown constants.
  Scalar least_log_density = -std::numeric_limits<Scalar>::infinity();
};

/// Where an ascent ended.
template <class Scalar>
struct AscentEnd {
  static constexpr Scalar kNowhere = -std::numeric_limits<Scalar>::infinity();

  Scalar log_density = kNowhere;   ///< of prior times likelihood at the highest point
  Scalar log_evidence = kNowhere;  ///< of the mode; kNowhere unless the ascent settled in one
  /// Whether it passed a place that is no negligible part of the density, although it is six standard
  /// deviations of the posterior or more away: the flank of a second mode, or a tail.
  bool beyond_covariance = false;
};

/// The ascent of prior times likelihood from a place beside the posterior: back to it, or to another mode.
///
/// Each step conditions the prior on a model about the current place, as the updates do, and is halved until
/// the density is no lower. `local_model(density)` is a std::optional<LocalModel>; nothing where the
/// likelihood cannot be computed.
template <class Density, class Model>
class ModeAscent {
  using Chart = typename Density::Chart;
  using Scalar = typename Density::Scalar;
  static constexpr int N = Chart::kDim;
  using End = AscentEnd<Scalar>;

 public:
  /// `peak` is the log of prior times likelihood at the posterior's mean.
  ModeAscent(const SqrtGaussian<Density>& prior, const SqrtGaussian<Density>& posterior, Scalar peak,
             Model& local_model)
      : prior_(prior),
        posterior_(posterior),
        units_(prior, posterior),
        peak_(peak),
        local_model_(local_model) {}

  /// From the posterior's mean moved by a step in units of the prior. Ends nowhere if it leads back to the
  /// posterior, or out of the chart, and at the first place beyond the posterior's covariance.
  [[nodiscard]] End from(const Vector<Scalar, N>& step) const {
    const Vector<Scalar, N> y = solve<Scalar, N, 1>(units_.posterior_root, step);
    return climb(moved(posterior_, {y, Matrix<Scalar, N>::Identity(), 0, 0}));
  }

  /// The same from the prior's mean moved by y in its whitened coordinates.
  [[nodiscard]] End from_prior(const Vector<Scalar, N>& y) const {
    return climb(prior_.moved(prior_, {y, posterior_.whitened_root, 0, 0}));
  }

 private:
  static constexpr int kMostFits = 16;
  static constexpr Scalar kLoss{0.5};                // of the log-density: a smaller one is none
  static constexpr Scalar kShortest = Scalar(0.01);  // share of a step
  static constexpr Scalar kSettled = Scalar(0.3);    // standard deviations
  static constexpr Scalar kSame{3};                  // standard deviations of the posterior
  static constexpr Scalar kApart{6};                 // the same, of places at which the density is negligible

  [[nodiscard]] End climb(std::optional<SqrtGaussian<Density>> density) const {
    if (!density) return {};
    auto last = *density;
    ConditionedGaussian<Scalar, N> climb{};
    End end;
    Scalar share(1);
    for (int fits = 0; fits < kMostFits; ++fits) {
      const auto local = local_model_(*density);
      const Scalar height = local ? height_of(*density, *local) : End::kNowhere;
      if (height > end.log_density - kLoss) {
        climb = density->condition_prior(local->model);
        if (!climb.finite() || !std::isfinite(climb.log_evidence)) return {};
        end.log_density = height;
        end.beyond_covariance =
            height > peak_ - kNegligibleFall<Scalar> && deviations_squared(*density) >= kApart * kApart;
        if (end.beyond_covariance) return end;
        if (is_settled(climb, kSettled)) {
          end.log_evidence = climb.log_evidence;
          return end;
        }
        last = *density;
        share = Scalar(1);
      } else if (fits == 0) {
        return {};
      } else {
        share /= Scalar(2);
      }
      density = moved_by_share(last, climb, share);
      if (!density || is_posterior(*density)) return {};
    }
    return end;
  }

  [[nodiscard]] static Scalar height_of(const SqrtGaussian<Density>& density,
                                        const LocalModel<Scalar, N>& local) {
    return local.log_likelihood - Scalar(0.5) * density.whitened_mean.squaredNorm();
  }

  /// The density at y of another one. The way there may lead around half a turn, to which charts reach.
  [[nodiscard]] std::optional<SqrtGaussian<Density>> moved(const SqrtGaussian<Density>& from,
                                                           const ConditionedGaussian<Scalar, N>& y) const {
    if (!units_.regular) return from.moved(prior_, y);
    const Vector<Scalar, N> xi = from.L * y.mean;
    if (!std::isfinite(xi.squaredNorm()) || !Chart::contains(xi)) return std::nullopt;
    const SqrtGaussian<Density> to{Chart::normalized(Chart::retract(from.mean, xi)),
                                   Chart::jacobian(xi) * (from.L * y.root)};
    if (!to.has_finite_samples()) return std::nullopt;
    return to.seen_from(prior_);
  }

  /// The same for a share of the way, halved until it stays in the chart.
  [[nodiscard]] std::optional<SqrtGaussian<Density>> moved_by_share(const SqrtGaussian<Density>& from,
                                                                    const ConditionedGaussian<Scalar, N>& y,
                                                                    Scalar& share) const {
    for (; share >= kShortest; share /= Scalar(2)) {
      auto to = moved(from, share < Scalar(1) ? damped(y, share) : y);
      if (to) return to;
    }
    return std::nullopt;
  }

  /// The squared distance from the posterior's mean, in the posterior's standard deviations.
  [[nodiscard]] Scalar deviations_squared(const SqrtGaussian<Density>& density) const {
    const Vector<Scalar, N> away = density.whitened_mean - posterior_.whitened_mean;
    return solve<Scalar, N, 1>(posterior_.whitened_root, away).squaredNorm();
  }
  [[nodiscard]] bool is_posterior(const SqrtGaussian<Density>& density) const {
    return deviations_squared(density) < kSame * kSame;
  }

  const SqrtGaussian<Density>& prior_;
  const SqrtGaussian<Density>& posterior_;
  const PriorUnits<Density> units_;
  const Scalar peak_;
  Model& local_model_;
};

}  // namespace antipode::detail
