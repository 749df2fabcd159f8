// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>
#include <utility>

#include <antipode/distributions/mixture.hpp>
#include <antipode/distributions/mixture_reduction.hpp>
#include <antipode/distributions/projected_gaussian.hpp>
#include <antipode/distributions/projected_gaussian_operations.hpp>
#include <antipode/filters/update_status.hpp>

/// @file
/// A filter bank for a moving pose: MPG in the dynamic case, which the paper leaves open (sec. VII).
namespace antipode {

/// How a MixtureFilter moves, fuses and reduces its belief.
template <std::floating_point Scalar>
struct MixtureFilterOptions {
  Transport transport = Transport::kLinearized;  ///< of the motion
  MixtureFusionOptions<Scalar> fusion = {};      ///< of belief and measurement
  /// Reduction of the belief after every prediction and update.
  MixtureReductionOptions<Scalar> reduction = {.max_components = 10, .min_weight = Scalar(1e-6)};
};

/// What a prediction or an update of a MixtureFilter did.
template <std::floating_point Scalar>
struct MixtureFilterStep {
  /// kNoSupport: no pair of a component of the belief and one of the measurement is compatible. The gate
  /// rejected all, or the components are so far apart that the mass of their products underflows. The belief
  /// stays as it was.
  UpdateStatus status = UpdateStatus::kConverged;
  Scalar log_evidence = 0;         ///< of an update: log of the integral of belief times measurement
  Scalar rejected_weight = 0;      ///< of the pairs that the plausibility gate rejected; 1 with kNoSupport
  Scalar linearization_bound = 0;  ///< see Fusion
  Scalar reduction_bound = 0;      ///< the reduction changes no probability by more
};

/// Estimates a pose T_world_body, known by a mixture, from uncertain motions and measurements of it. Both may
/// be mixtures: wheels that may slip, a marker seen from one of two sides.
template <std::floating_point Scalar>
class MixtureFilter {
 public:
  using Component = ProjectedGaussian<Scalar>;   ///< one hypothesis
  using Belief = Mixture<Component>;             ///< all of them, with their probabilities
  using Options = MixtureFilterOptions<Scalar>;  ///< of every step
  using Step = MixtureFilterStep<Scalar>;        ///< what a step did

  /// Starts from a belief, which is not reduced before the first step.
  explicit MixtureFilter(Belief belief, const Options& options = {})
      : belief_(std::move(belief)), options_(options) {}

  /// What is known of T_world_body.
  [[nodiscard]] const Belief& belief() const noexcept { return belief_; }

  /// x <- x u with the motion u = T_before_now: a known pose, a density or a mixture, independent of x.
  template <class Motion>
  Step predict(const Motion& T_before_now) {
    Step step;
    keep(compose(belief_, T_before_now, options_.transport), step);
    return step;
  }

  /// The belief given a measurement of the same pose, independent of what is known (MPG Eqs. 19-20).
  Step update(const Belief& measurement) {
    Step step;
    auto fused = try_fuse(belief_, measurement, options_.fusion);
    if (!fused) {
      step.status = UpdateStatus::kNoSupport;
      step.rejected_weight = Scalar(1);
      return step;
    }
    step.log_evidence = fused->log_mass;
    step.rejected_weight = fused->rejected_weight;
    step.linearization_bound = fused->linearization_bound;
    keep(fused->mixture, step);
    return step;
  }

 private:
  void keep(const Belief& belief, Step& step) {
    auto reduced = reduce(belief, options_.reduction);
    step.reduction_bound = reduced.probability_bound;
    belief_ = std::move(reduced.mixture);
  }

  Belief belief_;
  Options options_;
};

}  // namespace antipode
