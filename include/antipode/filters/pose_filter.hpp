// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>
#include <utility>

#include <antipode/cubature/gaussian_rules.hpp>
#include <antipode/detail/check.hpp>
#include <antipode/distributions/bingham_gaussian.hpp>
#include <antipode/distributions/pose_gaussian.hpp>
#include <antipode/filters/detail/sqrt_pose_gaussian.hpp>
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

/// A recursive filter for a pose, composed of a density, a sigma point rule and an update.
///
///   density           rules                                         updates
///   BinghamGaussian   PaperPoseRule, RichPoseRule, JointPoseRule    ProgressiveReweighting
///   PoseGaussian      MysovskikhRule<6>, Degree5Rule<6>             QuadraticProgression
///   PoseGaussian      CubatureRule<6>, UnscentedRule<6>, ...        PosteriorLinearization
///
/// All compositions have the same interface: they start from, predict with and report a PoseGaussian. The
/// names at the end of this file are the recommended compositions.
namespace antipode {

/// Reweights the rule's samples of a BinghamGaussian in powers of the likelihood (progressive_update.hpp). A
/// density that collapsed to its floor under steps longer than tau allows is reported as kDiverged.
template <std::floating_point Scalar>
struct ProgressiveReweighting {
  ProgressiveOptions<Scalar> options = {};

  template <class L, PoseRule<BinghamGaussian<Scalar>> Rule>
  requires LogLikelihood<L, Scalar, Rule::kCount>
  [[nodiscard]] ProgressiveResult<Scalar> operator()(const BinghamGaussian<Scalar>& prior, L&& log_likelihood,
                                                     const Rule& rule) const {
    auto result = progressive_update(prior, std::forward<L>(log_likelihood), rule, options);
    if (result.step_floor_hit && result.moment_floor_hit) result.status = UpdateStatus::kDiverged;
    return result;
  }
};

/// With the constants of DQV-SLAM: small steps, and no coupling of orientation and translation.
template <std::floating_point Scalar>
struct PaperReweighting : ProgressiveReweighting<Scalar> {
  constexpr PaperReweighting()
      : ProgressiveReweighting<Scalar>{{.tau = Scalar(0.02), .keep_coupling = false}} {}
};

/// Conditions a PoseGaussian on quadratic models of the log-likelihood (quadratic_update.hpp).
template <std::floating_point Scalar>
struct QuadraticProgression {
  QuadraticUpdateOptions<Scalar> options = {};

  template <class L, GaussianRule Rule>
  requires LogLikelihood<L, Scalar, Rule::kCount>
  [[nodiscard]] PoseUpdateResult<Scalar> operator()(const PoseGaussian<Scalar>& prior, L&& log_likelihood,
                                                    const Rule& rule) const {
    return quadratic_update(prior, std::forward<L>(log_likelihood), options, rule);
  }
};

/// Conditions a PoseGaussian on linear models of the measurements (linearized_update.hpp).
template <std::floating_point Scalar>
struct PosteriorLinearization {
  LinearizedUpdateOptions<Scalar> options = {};

  template <int Dim, class Model, GaussianRule Rule>
  [[nodiscard]] PoseUpdateResult<Scalar> operator()(
      const PoseGaussian<Scalar>& prior, const GaussianMeasurements<Scalar, Dim, Model>& measurements,
      const Rule& rule) const {
    return linearized_update(prior, measurements.measurements(), measurements.model(), options, rule);
  }
};

namespace detail {

template <class Density, class Other>
[[nodiscard]] Density converted_to(const Other& density) {
  if constexpr (std::same_as<Density, Other>) {
    return density;
  } else if constexpr (std::same_as<Density, PoseGaussian<typename Other::Scalar>>) {
    return to_pose_gaussian(density);
  } else {
    return to_bingham_gaussian(density);
  }
}

template <class Scalar>
[[nodiscard]] const PoseUpdateResult<Scalar>& as_pose_update_result(const PoseUpdateResult<Scalar>& result) {
  return result;
}
template <class Scalar>
[[nodiscard]] PoseUpdateResult<Scalar> as_pose_update_result(const ProgressiveResult<Scalar>& result) {
  return {.posterior = to_pose_gaussian(result.posterior),
          .status = result.status,
          .steps = result.steps,
          .evaluations = result.evaluations,
          .log_evidence = result.log_evidence,
          .log_likelihood = result.log_likelihood,
          .limit_hit = result.step_floor_hit};
}

}  // namespace detail

/// Estimates the pose T_world_body of a moving body from its measured motions and from measurements of any
/// kind.
template <class Density_, class Rule, class Update>
class PoseFilter {
 public:
  using Density = Density_;
  using Scalar = typename Density::Scalar;
  using Pose = DualQuaternion<Scalar>;

  /// Starts from a pose and its 6x6 covariance: PoseFilter({pose, covariance}). A BinghamGaussian has no
  /// variance of the orientation below 1e-14. Throws unless the covariance is positive semidefinite.
  explicit PoseFilter(const PoseGaussian<Scalar>& belief, Rule rule = {}, Update update = {})
      : density_(detail::converted_to<Density>(belief)), rule_(std::move(rule)), update_(std::move(update)) {
    (void)detail::SqrtPoseGaussian<Scalar>::of(belief);
  }
  explicit PoseFilter(const BinghamGaussian<Scalar>& belief, Rule rule = {}, Update update = {})
      : density_(detail::converted_to<Density>(belief)), rule_(std::move(rule)), update_(std::move(update)) {}

  /// The estimated pose and its covariance.
  [[nodiscard]] PoseGaussian<Scalar> belief() const {
    return detail::converted_to<PoseGaussian<Scalar>>(density_);
  }
  /// The density that the filter works with.
  [[nodiscard]] const Density& density() const noexcept { return density_; }

  /// x <- x u v with the measured motion u = T_before_now and its noise v, {identity, covariance},
  /// independent of x. In closed form for a PoseGaussian, through the samples of the rule for a
  /// BinghamGaussian. Throws if the motion is not finite or the covariance of the noise not positive
  /// semidefinite; the belief stays as it was.
  void predict(const Pose& T_before_now, const PoseGaussian<Scalar>& noise) {
    (void)detail::SqrtPoseGaussian<Scalar>::of(noise);
    predict_with(T_before_now, detail::converted_to<Density>(noise));
  }
  void predict(const Pose& T_before_now, const BinghamGaussian<Scalar>& noise) {
    predict_with(T_before_now, detail::converted_to<Density>(noise));
  }

  /// The belief given a measurement: a log-likelihood (log_likelihood.hpp) or GaussianMeasurements; updates
  /// that linearise the measurement take GaussianMeasurements only. If the result's status is not kConverged
  /// the belief stays as it was.
  template <class Measurement>
  requires std::invocable<const Update&, const Density&, Measurement, const Rule&> PoseUpdateResult<Scalar>
  update(Measurement&& measurement) {
    const auto result = update_(density_, std::forward<Measurement>(measurement), rule_);
    if (result.status == UpdateStatus::kConverged) density_ = result.posterior;
    return detail::as_pose_update_result(result);
  }

 private:
  void predict_with(const Pose& T_before_now, const Density& noise) {
    detail::require_finite("motion is not finite", T_before_now.coeffs());
    if constexpr (std::same_as<Density, PoseGaussian<Scalar>>) {
      density_ = predict_closed_form(density_, T_before_now, noise);
    } else {
      const auto& options = update_.options;
      density_ = antipode::predict(
          density_, T_before_now, noise, rule_,
          {.keep_coupling = options.keep_coupling, .min_eigenvalue = options.min_eigenvalue});
    }
  }

  Density density_;
  Rule rule_;
  Update update_;
};

/// The filter of DQV-SLAM, 7 x 7 samples. It is overconfident and meant for comparison.
template <std::floating_point Scalar>
using PaperPoseFilter = PoseFilter<BinghamGaussian<Scalar>, PaperPoseRule, PaperReweighting<Scalar>>;

/// Follows wide orientation densities: the Bingham density with its coupling, sampled to degree 5.
template <std::floating_point Scalar>
using RichPoseFilter = PoseFilter<BinghamGaussian<Scalar>, RichPoseRule, ProgressiveReweighting<Scalar>>;

/// For any likelihood with one mode: the default.
template <std::floating_point Scalar>
using QuadraticPoseFilter = PoseFilter<PoseGaussian<Scalar>, MysovskikhRule<6>, QuadraticProgression<Scalar>>;

/// For many vector measurements with Gaussian noise: the fastest.
template <std::floating_point Scalar>
using LinearizedPoseFilter =
    PoseFilter<PoseGaussian<Scalar>, CubatureRule<6>, PosteriorLinearization<Scalar>>;

}  // namespace antipode
