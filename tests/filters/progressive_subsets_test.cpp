// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include <antipode/detail/cholesky.hpp>
#include <antipode/filters/progressive_update.hpp>
#include <antipode/filters/update_status.hpp>

#include "filters/models.hpp"
#include "support/catch.hpp"
#include "support/error_message.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

/// The landmarks begin..end-1 of a scene.
[[nodiscard]] StereoScene<double> part_of(const StereoScene<double>& scene, int begin, int end) {
  StereoScene<double> part = scene;
  part.landmarks.assign(scene.landmarks.begin() + begin, scene.landmarks.begin() + end);
  part.measurements.assign(scene.measurements.begin() + begin, scene.measurements.begin() + end);
  return part;
}

struct Scenario {
  PoseGaussian<double> prior;
  DualQuaternion<double> truth;
  StereoScene<double> scene;

  Scenario(Rng& rng, int landmarks)
      : prior{random_pose<double>(rng), pose_covariance<double>(0.02, 0.2)},
        truth(draw(rng, prior)),
        scene(StereoScene<double>::random(rng, truth, landmarks)) {}

  [[nodiscard]] auto likelihood_of() const {
    return [this](int begin, int end) -> AnyLogLikelihood<double> { return part_of(scene, begin, end); };
  }
};

using LikelihoodOf = std::function<AnyLogLikelihood<double>(int, int)>;

/// progressive_update_subsets, compiled once for each rule.
template <class Rule>
[[nodiscard]] ProgressiveResult<double> update(const BinghamGaussian<double>& prior, int count,
                                               const LikelihoodOf& likelihood_of, const Rule& rule,
                                               const SubsetOptions<double>& options = {}) {
  return progressive_update_subsets(prior, count, likelihood_of, rule, options);
}

[[nodiscard]] AnyLogLikelihood<double> flat(int, int) {
  return [](const DualQuaternion<double>&) { return 0.0; };
}

/// The largest component of the difference of the means, in standard deviations.
[[nodiscard]] double distance_in_sigmas(const BinghamGaussian<double>& a, const BinghamGaussian<double>& b) {
  const Vector6<double> error = b.pose().boxminus(a.pose());
  const Matrix6<double> P = a.covariance();
  double largest = 0.0;
  for (int i = 0; i < 6; ++i) largest = std::max(largest, std::abs(error[i]) / std::sqrt(P(i, i)));
  return largest;
}

}  // namespace

TEST_CASE("Subsets, in any order, agree with all at once to the accuracy of the steps",
          "[progressive][subsets]") {
  for (unsigned seed = 0; seed < 3; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const Scenario s(rng, 80);
    const auto prior = to_bingham_gaussian(s.prior);
    const ProgressiveOptions<double> options{.tau = 0.8};
    const auto at_once = update(prior, 80, [&](int, int) { return s.scene; }, RichPoseRule{},
                                {.progressive = options, .max_size = 80});
    const auto in_subsets = update(prior, 80, s.likelihood_of(), RichPoseRule{}, {.progressive = options});
    Scenario reversed = s;
    std::reverse(reversed.scene.landmarks.begin(), reversed.scene.landmarks.end());
    std::reverse(reversed.scene.measurements.begin(), reversed.scene.measurements.end());
    const auto backwards =
        update(prior, 80, reversed.likelihood_of(), RichPoseRule{}, {.progressive = options});
    for (const auto& result : {in_subsets, backwards}) {
      CHECK(result.status == UpdateStatus::kConverged);
      CHECK(distance_in_sigmas(at_once.posterior, result.posterior) <= 0.1);
      const auto L = detail::cholesky_factor(result.posterior.covariance()).value();
      const auto L_at_once = detail::cholesky_factor(at_once.posterior.covariance()).value();
      double log_ratio = 0.0;  // of the variances, on average
      for (int i = 0; i < 6; ++i) log_ratio += 2.0 / 6.0 * std::log(L(i, i) / L_at_once(i, i));
      CHECK(std::abs(log_ratio) <= 0.03);
      CHECK(std::abs(result.log_evidence - at_once.log_evidence) <= 0.3);
    }
  }
}

TEST_CASE("Subsets are even, within the limit, and cover every measurement once", "[progressive][subsets]") {
  const auto prior = to_bingham_gaussian(PoseGaussian<double>{{}, pose_covariance<double>(0.1, 1.0)});
  for (int count : {1, 29, 30, 31, 60, 61, 100}) {
    CAPTURE(count);
    int next = 0, smallest = count, largest = 0;
    const auto likelihood_of = [&](int begin, int end) {
      CHECK(begin == next);
      next = end;
      smallest = std::min(smallest, end - begin);
      largest = std::max(largest, end - begin);
      return flat(begin, end);
    };
    const auto result = update(prior, count, likelihood_of, JointPoseRule{});
    CHECK(next == count);
    CHECK(largest <= 30);
    CHECK(largest - smallest <= 1);
    CHECK(result.steps == (count + 29) / 30);
    CHECK(result.evaluations == result.steps * long{JointPoseRule::kCount});
  }
}

TEST_CASE("No measurement at all leaves the prior", "[progressive][subsets]") {
  Rng rng(1);
  const Scenario s(rng, 1);
  const auto prior = to_bingham_gaussian(s.prior);
  const auto result = update(prior, 0, s.likelihood_of(), JointPoseRule{});
  CHECK(result.status == UpdateStatus::kConverged);
  CHECK(result.steps == 0);
  CHECK(max_difference(result.posterior.covariance(), prior.covariance()) == 0.0);
}

TEST_CASE("A failing subset returns the prior", "[progressive][subsets]") {
  Rng rng(2);
  const Scenario s(rng, 40);
  const auto prior = to_bingham_gaussian(s.prior);
  const auto likelihood_of = [&](int begin, int end) {
    return AnyLogLikelihood<double>(
        [&, part = part_of(s.scene, begin, end), begin](const DualQuaternion<double>& x) {
          return begin > 0 ? std::nan("") : part(x);
        });
  };
  const auto result = update(prior, 40, likelihood_of, JointPoseRule{});
  CHECK(result.status == UpdateStatus::kNotFinite);
  CHECK(max_difference(result.posterior.mean_translation(), prior.mean_translation()) == 0.0);
}

TEST_CASE("Divergence is judged over all subsets together", "[progressive][subsets]") {
  Rng rng(3);
  const Scenario s(rng, 60);
  const auto run = [&](double min_log_likelihood) {
    return update(to_bingham_gaussian(s.prior), 60, s.likelihood_of(), JointPoseRule{},
                  {.progressive = {.min_log_likelihood = min_log_likelihood}});
  };
  const auto result = run(-1e9);
  CHECK(result.status == UpdateStatus::kConverged);
  CHECK(run(result.log_likelihood - 1.0).status == UpdateStatus::kConverged);
  CHECK(run(result.log_likelihood + 1.0).status == UpdateStatus::kDiverged);
}

TEST_CASE("The regulariser widens the density between subsets, and only there", "[progressive][subsets]") {
  const auto prior = to_bingham_gaussian(PoseGaussian<double>{{}, pose_covariance<double>(0.01, 0.1)});
  const auto run = [&](int count, const SubsetOptions<double>& options) {
    return update(prior, count, flat, JointPoseRule{}, options).posterior;
  };
  const SubsetOptions<double> regularizer{.min_translation_sigma_m = 0.2, .forgetting = 1e-3};
  const auto one = run(30, regularizer);
  const auto three = run(90, regularizer);
  CHECK(one.translation_covariance().trace() == Approx(3 * 0.01).epsilon(1e-9));
  CHECK(three.translation_covariance().trace() == Approx(3 * (0.01 + 2 * 0.04)).epsilon(1e-9));
  CHECK(one.orientation().concentrations()[0] ==
        Approx(prior.orientation().concentrations()[0]).epsilon(1e-6));
  CHECK(three.orientation().concentrations()[0] ==
        Approx(prior.orientation().concentrations()[0] / (1.001 * 1.001)).epsilon(1e-6));
}

TEST_CASE("Invalid subsets are refused with the value", "[progressive][subsets]") {
  const auto prior = to_bingham_gaussian(PoseGaussian<double>{{}, pose_covariance<double>(0.01, 0.1)});
  const auto message = [&](int count, const SubsetOptions<double>& options) {
    return error_message([&] { return update(prior, count, flat, JointPoseRule{}, options).steps; });
  };
  CHECK(contains(message(-1, {}), "number of measurements is negative: -1"));
  CHECK(contains(message(1, {.max_size = 0}), "max_size of a subset is not positive: 0"));
  CHECK(contains(message(1, {.min_translation_sigma_m = -2.0}),
                 "min_translation_sigma_m is not in [0, inf): -2"));
  CHECK(contains(message(1, {.forgetting = 0.1}), "forgetting is not in [0, 1e-3]: 0.1"));
}
