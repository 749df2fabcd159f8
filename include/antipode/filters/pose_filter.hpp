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
#include <antipode/filters/predict.hpp>
#include <antipode/filters/progressive_update.hpp>
#include <antipode/filters/quadratic_update.hpp>
#include <antipode/filters/update_status.hpp>
#include <antipode/geometry/dual_quaternion.hpp>
#include <antipode/sampling/pose_rules.hpp>
#include <antipode/sampling/sigma_point_rule.hpp>

/// A recursive filter for a pose, put together from a density, a sigma point rule and an update.
///
///   density           rules                                         updates
///   BinghamGaussian   PaperPoseRule, RichPoseRule, JointPoseRule    ProgressiveReweighting
///   PoseGaussian      MysovskikhRule<6>, Degree5Rule<6>             QuadraticProgression
///   PoseGaussian      CubatureRule<6>, UnscentedRule<6>, ...        PosteriorLinearization
///
/// The names at the end of this file are the combinations that are worth having.
namespace antipode {

/// Reweights the rule's samples of a BinghamGaussian in powers of the likelihood (progressive_update.hpp). A
/// density that collapsed to its floor under steps longer than tau allows is no posterior: kDiverged.
template <std::floating_point Scalar>
struct ProgressiveReweighting {
  ProgressiveOptions<Scalar> options = {};

  template <class L, PoseRule<BinghamGaussian<Scalar>> Rule>
  [[nodiscard]] auto operator()(const BinghamGaussian<Scalar>& prior, L&& log_likelihood,
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

/// The pose T_world_body of something that moves, from its measured motions and from measurements of any
/// kind.
template <class Density_, class Rule, class Update>
class PoseFilter {
 public:
  using Density = Density_;
  using Scalar = typename Density::Scalar;

  explicit PoseFilter(Density belief, Rule rule = {}, Update update = {})
      : belief_(std::move(belief)), rule_(std::move(rule)), update_(std::move(update)) {}

  [[nodiscard]] const Density& belief() const noexcept { return belief_; }

  /// x <- x u v with the measured motion u = T_before_now and its noise v, independent of x. In closed form
  /// for a PoseGaussian, through the samples of the rule for a BinghamGaussian. Throws if the motion is not
  /// finite or the covariance of the noise not positive semidefinite; the belief stays as it was.
  void predict(const DualQuaternion<Scalar>& T_before_now, const Density& noise) {
    detail::require_finite("motion is not finite", T_before_now.coeffs());
    if constexpr (std::same_as<Density, PoseGaussian<Scalar>>) {
      (void)detail::SqrtPoseGaussian<Scalar>::of(noise);
      belief_ = predict_closed_form(belief_, T_before_now, noise);
    } else {
      const auto& options = update_.options;
      belief_ = antipode::predict(
          belief_, T_before_now, noise, rule_,
          {.keep_coupling = options.keep_coupling, .min_eigenvalue = options.min_eigenvalue});
    }
  }

  /// The belief given a measurement: a log-likelihood (log_likelihood.hpp) or GaussianMeasurements. If the
  /// result's status is not kConverged the belief stays as it was.
  template <class Measurement>
  auto update(Measurement&& measurement) {
    auto result = update_(belief_, std::forward<Measurement>(measurement), rule_);
    if (result.status == UpdateStatus::kConverged) belief_ = result.posterior;
    return result;
  }

 private:
  Density belief_;
  Rule rule_;
  Update update_;
};

/// The filter of DQV-SLAM, 7 x 7 samples. It is overconfident; it is here to compare with.
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
