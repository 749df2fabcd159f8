// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>
#include <cstdint>
#include <utility>

#include <antipode/detail/check.hpp>
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
  /// Of belief and measurement. Components that agree are fused at any angle between them: a right
  /// measurement is rejected by chance once in a thousand times at most (the quantile of chi-square with six
  /// degrees). Components with standard deviations of .4 rad each, half a turn apart, are not (5.5 standard
  /// deviations).
  MixtureFusionOptions<Scalar> fusion = {.agreement = Scalar(22.46)};
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
    keep(reduced(compose(belief_, T_before_now, options_.transport), step));
    return step;
  }

  /// A result of propose(), which commit() makes the belief.
  class Proposal : public Step {
   public:
    /// The posterior; the belief as it was if the status is kNoSupport.
    [[nodiscard]] const Belief& posterior() const noexcept { return posterior_; }

   private:
    friend MixtureFilter;
    Proposal(const Step& step, Belief posterior, std::uint64_t belief)
        : Step(step), posterior_(std::move(posterior)), belief_(belief) {}

    Belief posterior_;
    std::uint64_t belief_;  ///< the belief it was computed from
  };

  /// What update() would make of the belief, which stays as it is: to gate a measurement by log_evidence or
  /// rejected_weight.
  [[nodiscard]] Proposal propose(const Belief& measurement) const {
    Step step;
    auto fused = try_fuse(belief_, measurement, options_.fusion);
    if (!fused) {
      step.status = UpdateStatus::kNoSupport;
      step.rejected_weight = Scalar(1);
      return {step, belief_, beliefs_};
    }
    step.log_evidence = fused->log_mass;
    step.rejected_weight = fused->rejected_weight;
    step.linearization_bound = fused->linearization_bound;
    auto posterior = reduced(fused->mixture, step);
    return {step, std::move(posterior), beliefs_};
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
    keep(proposal.posterior_);
    return true;
  }

  /// The belief given a measurement of the same pose, independent of what is known (MPG Eqs. 19-20). It is
  /// propose() and commit() in one.
  Step update(const Belief& measurement) {
    Proposal proposal = propose(measurement);
    (void)commit(proposal);
    return proposal;
  }

 private:
  [[nodiscard]] Belief reduced(const Belief& belief, Step& step) const {
    auto result = reduce(belief, options_.reduction);
    step.reduction_bound = result.probability_bound;
    return std::move(result.mixture);
  }
  void keep(Belief belief) {
    belief_ = std::move(belief);
    ++beliefs_;
  }

  Belief belief_;
  std::uint64_t beliefs_ = 0;  ///< how many there were before this one
  Options options_;
};

}  // namespace antipode
