// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>
#include <cstdint>
#include <limits>
#include <type_traits>
#include <utility>

#include <antipode/cubature/gaussian_rules.hpp>
#include <antipode/detail/check.hpp>
#include <antipode/distributions/bingham_gaussian.hpp>
#include <antipode/distributions/pose_charts.hpp>
#include <antipode/distributions/pose_gaussian.hpp>
#include <antipode/distributions/projected_gaussian_conversions.hpp>
#include <antipode/distributions/state_gaussian.hpp>
#include <antipode/filters/detail/sqrt_gaussian.hpp>
#include <antipode/filters/gauss_newton_update.hpp>
#include <antipode/filters/gaussian_measurements.hpp>
#include <antipode/filters/linearized_update.hpp>
#include <antipode/filters/log_likelihood.hpp>
#include <antipode/filters/pose_update_result.hpp>
#include <antipode/filters/predict.hpp>
#include <antipode/filters/progressive_update.hpp>
#include <antipode/filters/quadratic_update.hpp>
#include <antipode/filters/update_status.hpp>
#include <antipode/geometry/dual_quaternion.hpp>
#include <antipode/sampling/pose_rules.hpp>
#include <antipode/sampling/sigma_point_rule.hpp>

/// @file
/// A recursive filter for a pose, composed of a density, a sigma point rule and an update.
///
///     density           rules                                         updates
///     BinghamGaussian   PaperPoseRule, RichPoseRule, JointPoseRule    ProgressiveReweighting
///     PoseGaussian      MysovskikhRule<6>, Degree5Rule<6>             QuadraticProgression
///     PoseGaussian      MysovskikhRule<6>, CubatureRule<6>, ...       PosteriorLinearization
///     PoseGaussian      any: it takes no samples                      GaussNewton
///     StateGaussian     Degree5Rule<N>, CubatureRule<N>, ...          PosteriorLinearization, GaussNewton
///     StateGaussian     Degree5Rule<N>, N up to 18                    QuadraticProgression
///
/// All compositions for poses have the same interface: they start from, predict with and report a
/// PoseGaussian. The chart of the PoseGaussian is part of its type: the split chart is for filters that
/// measure positions. A StateGaussian is for joint states, a pose with its velocity say. The names at the end
/// of this file are the recommended compositions.
namespace antipode {

/// Reweights the rule's samples of a BinghamGaussian in powers of the likelihood (progressive_update.hpp).
template <std::floating_point Scalar>
struct ProgressiveReweighting {
  ProgressiveOptions<Scalar> options = {};  ///< of progressive_update

  /// progressive_update of the prior.
  template <class L, PoseRule<BinghamGaussian<Scalar>> Rule>
  requires LogLikelihood<L, Scalar, Rule::kCount>
  [[nodiscard]] ProgressiveResult<Scalar> operator()(const BinghamGaussian<Scalar>& prior, L&& log_likelihood,
                                                     const Rule& rule) const {
    return progressive_update(prior, std::forward<L>(log_likelihood), rule, options);
  }
};

/// ProgressiveReweighting as in DQV-SLAM: small steps, no coupling of orientation and translation, and no
/// limit of the residual.
template <std::floating_point Scalar>
struct PaperReweighting : ProgressiveReweighting<Scalar> {
  /// tau = 0.02, of which the paper gives no value.
  constexpr PaperReweighting()
      : ProgressiveReweighting<Scalar>{{.tau = Scalar(0.02),
                                        .keep_coupling = false,
                                        .max_final_residual = std::numeric_limits<Scalar>::infinity()}} {}
};

/// Conditions a concentrated density on quadratic models of the log-likelihood (quadratic_update.hpp).
template <std::floating_point Scalar>
struct QuadraticProgression {
  QuadraticUpdateOptions<Scalar> options = {};  ///< of quadratic_update

  /// quadratic_update of the prior.
  template <ConcentratedDensity Density, class L, GaussianRule Rule>
  requires LogLikelihoodOver<L, Density, Rule::kCount>
  [[nodiscard]] UpdateResult<Density> operator()(const Density& prior, L&& log_likelihood,
                                                 const Rule& rule) const {
    return quadratic_update(prior, std::forward<L>(log_likelihood), options, rule);
  }
};

/// Conditions a concentrated density on linear models of the measurements (linearized_update.hpp).
template <std::floating_point Scalar>
struct PosteriorLinearization {
  LinearizedUpdateOptions<Scalar> options = {};  ///< of linearized_update

  /// linearized_update of the prior.
  template <ConcentratedDensity Density, int Dim, class Model, GaussianRule Rule>
  [[nodiscard]] UpdateResult<Density> operator()(const Density& prior,
                                                 const GaussianMeasurements<Scalar, Dim, Model>& measurements,
                                                 const Rule& rule) const {
    return linearized_update(prior, measurements.measurements(), measurements.model(), options, rule);
  }
};

/// Conditions a concentrated density on measurements with a model that provides its Jacobians
/// (gauss_newton_update.hpp).
template <std::floating_point Scalar>
struct GaussNewton {
  GaussNewtonOptions<Scalar> options = {};  ///< of gauss_newton_update

  /// gauss_newton_update of the prior; the rule is not used.
  template <ConcentratedDensity Density, int Dim, class Model, GaussianRule Rule>
  requires DifferentiableModel<Model, Density, Dim>
  [[nodiscard]] UpdateResult<Density> operator()(const Density& prior,
                                                 const GaussianMeasurements<Scalar, Dim, Model>& measurements,
                                                 const Rule&) const {
    return gauss_newton_update(prior, measurements.measurements(), measurements.model(), options);
  }
};

namespace detail {

template <class Density, class Other>
[[nodiscard]] Density converted_to(const Other& density) {
  using Scalar = typename Density::Scalar;
  if constexpr (std::same_as<Density, Other>) {
    return density;
  } else if constexpr (std::same_as<Density, BinghamGaussian<Scalar>>) {
    return to_bingham_gaussian(density);
  } else if constexpr (std::same_as<Other, BinghamGaussian<Scalar>>) {
    if constexpr (std::same_as<Density, PoseGaussian<Scalar>>) {
      return to_pose_gaussian(density);
    } else {
      return to_split_pose_gaussian(density);
    }
  } else {
    return in_chart<typename Density::Chart>(density);
  }
}

/// What a filter with the given density starts from and reports.
template <class Density>
struct BeliefOf : std::type_identity<Density> {};
template <class Scalar>
struct BeliefOf<BinghamGaussian<Scalar>> : std::type_identity<PoseGaussian<Scalar>> {};

template <class Density>
[[nodiscard]] const UpdateResult<Density>& as_update_result(const UpdateResult<Density>& result) {
  return result;
}
template <class Scalar>
[[nodiscard]] PoseUpdateResult<Scalar> as_update_result(const ProgressiveResult<Scalar>& result) {
  return as_result_of(to_pose_gaussian(result.posterior), result, result.step_floor_hit);
}

}  // namespace detail

/// Estimates the pose T_world_body of a moving body, or a joint state, from its measured motions and from
/// measurements of any kind.
template <class Density_, class Rule, class Update>
class PoseFilter {
 public:
  using Density = Density_;                                 ///< what the filter works with
  using Scalar = typename Density::Scalar;                  ///< of states and covariances
  using Pose = DualQuaternion<Scalar>;                      ///< of states that are poses
  using Belief = typename detail::BeliefOf<Density>::type;  ///< a PoseGaussian or a StateGaussian
  using State = typename Belief::Chart::Point;              ///< a pose, or a tuple of the parts of the state
  using Square = Matrix<Scalar, Belief::Chart::kDim>;       ///< covariances and Jacobians

  /// Starts from a pose and its 6x6 covariance, in the filter's own chart: PoseFilter({pose, covariance}). A
  /// filter with a BinghamGaussian raises second moments of q to at least 1e-14. Throws unless the covariance
  /// is positive semidefinite.
  explicit PoseFilter(const Belief& belief, Rule rule = {}, Update update = {})
      : density_(detail::converted_to<Density>(checked(belief))),
        rule_(std::move(rule)),
        update_(std::move(update)) {}
  /// Starts from a pose density in another chart, which in_chart converts. Throws as above.
  template <class Chart>
  requires(std::same_as<State, Pose> && !std::same_as<PoseGaussian<Scalar, Chart>, Belief>)  //
      explicit PoseFilter(const PoseGaussian<Scalar, Chart>& belief, Rule rule = {}, Update update = {})
      : density_(detail::converted_to<Density>(checked(belief))),
        rule_(std::move(rule)),
        update_(std::move(update)) {}
  /// Starts from a BinghamGaussian.
  explicit PoseFilter(const BinghamGaussian<Scalar>& belief, Rule rule = {}, Update update = {})  //
      requires std::same_as<State, Pose>
      : density_(detail::converted_to<Density>(belief)), rule_(std::move(rule)), update_(std::move(update)) {}

  /// The estimated state and its covariance.
  [[nodiscard]] Belief belief() const { return detail::converted_to<Belief>(density_); }
  /// The density that the filter works with.
  [[nodiscard]] const Density& density() const noexcept { return density_; }

  /// x <- x u v with the measured motion u = T_before_now and its noise v, {identity, covariance},
  /// independent of x. In closed form for a PoseGaussian, through the samples of the rule for a
  /// BinghamGaussian. The closed form is of first order, for rotations of tens of milliradians; see
  /// predict_closed_form() for the size of its error and for what to use instead. Throws if the motion is not
  /// finite, the covariance of the noise not positive semidefinite or the result not finite; the belief then
  /// stays as it was.
  void predict(const Pose& T_before_now,
               const PoseGaussian<Scalar>& noise) requires std::same_as<State, Pose> {
    detail::require_finite("motion is not finite", T_before_now.coeffs());
    (void)checked(noise);
    if constexpr (std::same_as<Density, Belief>) {
      keep(finite(predict_closed_form(density_, T_before_now, noise)));
    } else {
      predict_with(T_before_now, detail::converted_to<Density>(noise));
    }
  }
  /// x <- x u v with a noise v that has a BinghamGaussian density. Throws if the motion or the result is not
  /// finite; the belief then stays as it was.
  void predict(const Pose& T_before_now,
               const BinghamGaussian<Scalar>& noise) requires std::same_as<State, Pose> {
    detail::require_finite("motion is not finite", T_before_now.coeffs());
    if constexpr (std::same_as<Density, Belief>) {
      keep(finite(predict_closed_form(density_, T_before_now, to_pose_gaussian(noise))));
    } else {
      predict_with(T_before_now, noise);
    }
  }

  /// x <- f(x) with the Jacobian of f at the mean, f(retract(x, a)) = retract(f(x), jacobian a), and the
  /// covariance of the noise, which is added to that of the vector about f(x). Throws if the covariance of
  /// the noise is not positive semidefinite or the result not finite; the belief then stays as it was.
  template <std::invocable<const State&> F>
  requires std::same_as<Density, Belief>
  void predict(F&& f, const std::type_identity_t<Square>& jacobian,
               const std::type_identity_t<Square>& noise) {
    keep(checked(predict_closed_form(density_, std::forward<F>(f), jacobian,
                                     checked(Belief{mean(), noise}).covariance)));
  }

  /// Whether update() takes such a measurement.
  template <class Measurement>
  static constexpr bool kTakes = std::invocable<const Update&, const Density&, Measurement, const Rule&>;

  /// A result of propose(), which commit() makes the belief.
  class Proposal : public UpdateResult<Belief> {
   private:
    friend PoseFilter;
    Proposal(UpdateResult<Belief> result, Density density, std::uint64_t belief)
        : UpdateResult<Belief>(std::move(result)), density_(std::move(density)), belief_(belief) {}

    Density density_;       ///< the posterior as the filter works with it
    std::uint64_t belief_;  ///< the belief it was computed from
  };

  /// What update() would make of the belief, which stays as it is: to gate a measurement by its nis, or to
  /// choose between measurements by log_evidence. Takes what update() takes.
  template <class Measurement>
  [[nodiscard]] Proposal propose(Measurement&& measurement) const {
    static_assert(
        kTakes<Measurement>,
        "PoseFilter::update: the filter takes a log-likelihood, callable as Scalar(state), or "
        "GaussianMeasurements with a model h(state, i); if it linearises, GaussianMeasurements only; "
        "if it is a Gauss-Newton filter, with a model h(state, i, J)");
    const auto result = update_(density_, std::forward<Measurement>(measurement), rule_);
    return {detail::as_update_result(result), result.posterior, beliefs_};
  }
  /// Makes the posterior of a proposal the belief, unless its status is other than kConverged; returns
  /// whether. Throws std::invalid_argument if the belief has changed since the proposal was made: what was
  /// learnt in between would be lost.
  bool commit(const Proposal& proposal) {
    if (proposal.belief_ != beliefs_) [[unlikely]] {
      detail::throw_invalid("proposal is of an earlier belief; predictions and updates since it was made",
                            beliefs_ - proposal.belief_);
    }
    if (proposal.status != UpdateStatus::kConverged) return false;
    keep(proposal.density_);
    return true;
  }

  /// The belief given a measurement: a log-likelihood (log_likelihood.hpp) or GaussianMeasurements; updates
  /// that linearise the measurement take GaussianMeasurements only. If the result's status is not kConverged
  /// the belief stays as it was. It is propose() and commit() in one.
  template <class Measurement>
  UpdateResult<Belief> update(Measurement&& measurement) {
    Proposal proposal = propose(std::forward<Measurement>(measurement));
    (void)commit(proposal);
    return proposal;
  }

 private:
  template <class D>
  [[nodiscard]] static const D& checked(const D& density) {
    (void)detail::SqrtGaussian<D>::of(density);
    return density;
  }
  [[nodiscard]] static const Density& finite(const Density& prediction) {
    const auto& [mean, covariance] = prediction;
    Density::Chart::require_finite(mean);
    detail::require_finite("covariance of the prediction is not finite", covariance);
    return prediction;
  }
  [[nodiscard]] const State& mean() const {
    const auto& [mean, covariance] = density_;
    return mean;
  }
  void predict_with(const Pose& T_before_now, const Density& noise) {
    const auto& options = update_.options;
    keep(antipode::predict(
        density_, T_before_now, noise, rule_,
        {.keep_coupling = options.keep_coupling, .min_eigenvalue = options.min_eigenvalue}));
  }
  void keep(const Density& density) {
    density_ = density;
    ++beliefs_;
  }

  Density density_;
  std::uint64_t beliefs_ = 0;  ///< how many there were before this one
  Rule rule_;
  Update update_;
};

/// The filter of DQV-SLAM, 7 x 7 samples. It is overconfident and meant for comparison.
template <std::floating_point Scalar>
using PaperPoseFilter = PoseFilter<BinghamGaussian<Scalar>, PaperPoseRule, PaperReweighting<Scalar>>;

/// The Bingham density with its coupling, sampled to degree 5: for comparison with PaperPoseFilter. If a
/// measurement narrows some axes of a wide orientation only, gravity say, QuadraticPoseFilter converges more
/// often, and its covariance is closer to the error.
template <std::floating_point Scalar>
using RichPoseFilter = PoseFilter<BinghamGaussian<Scalar>, RichPoseRule, ProgressiveReweighting<Scalar>>;

/// For any likelihood with one mode: the default.
template <std::floating_point Scalar>
using QuadraticPoseFilter = PoseFilter<PoseGaussian<Scalar>, MysovskikhRule<6>, QuadraticProgression<Scalar>>;

/// For a few vector measurements with Gaussian noise. With CubatureRule<6> in place of MysovskikhRule<6> it
/// is faster, and right if the attitude is known to .05 rad (see linearized_update).
template <std::floating_point Scalar>
using LinearizedPoseFilter =
    PoseFilter<PoseGaussian<Scalar>, MysovskikhRule<6>, PosteriorLinearization<Scalar>>;

/// For measurements whose model provides its Jacobians.
template <std::floating_point Scalar>
using GaussNewtonPoseFilter = PoseFilter<PoseGaussian<Scalar>, MysovskikhRule<6>, GaussNewton<Scalar>>;

/// For positions measured while the attitude is uncertain (altimeter, GPS, ranges, bearings): rotation and
/// position apart.
template <std::floating_point Scalar>
using SplitPoseFilter =
    PoseFilter<SplitPoseGaussian<Scalar>, MysovskikhRule<6>, QuadraticProgression<Scalar>>;
/// The same for curved posteriors, the spherical shell of a range say. The covariance includes the curvature.
template <std::floating_point Scalar>
using LinearizedSplitPoseFilter =
    PoseFilter<SplitPoseGaussian<Scalar>, MysovskikhRule<6>, PosteriorLinearization<Scalar>>;

/// For joint states: StateFilter<ProductChart<SplitChart<double>, VectorChart<double, 3>>>. Its rule is exact
/// to degree 5 for up to 18 dimensions. For larger states, and for faster updates, use
/// PoseFilter<StateGaussian<C>, CubatureRule<C::kDim>, ...>, which is right if the attitude is known to .05
/// rad (see linearized_update).
template <Chart C>
using StateFilter =
    PoseFilter<StateGaussian<C>, detail::DefaultRule<C::kDim>, PosteriorLinearization<typename C::Scalar>>;

}  // namespace antipode
