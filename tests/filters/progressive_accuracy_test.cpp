// SPDX-License-Identifier: MIT
#include <cmath>

#include <antipode/filters/progressive_update.hpp>
#include <antipode/filters/update_status.hpp>

#include "filters/progressive_reference.hpp"
#include "support/catch.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

// DQV-SLAM's 7 x 7 points, as the independent implementation takes them.
constexpr PaperPoseRule kPaperRule{BinghamBaseRule{}, UnscentedRule<3>{.kappa = 0.5}};

/// The settings of the independent implementation.
[[nodiscard]] ProgressiveOptions<double> as_there(double tau, bool keep_coupling) {
  return {.tau = tau,
          .min_step = 0.01,
          .keep_coupling = keep_coupling,
          .min_eigenvalue = 5e-9,
          .max_restarts = 0};
}

}  // namespace

TEST_CASE("The progression takes the same steps as an independent implementation",
          "[progressive][reference]") {
  for (const auto& c : progressive_cases()) {
    if (c.weak_prior) continue;  // the densities collapse there, to rounding noise
    const auto check = [&](const char* variant, const auto& rule, const ProgressiveOptions<double>& options) {
      CAPTURE(c.name, variant);
      const auto result = progressive_update(c.prior, c.log_likelihood, rule, options);
      const Score score = c.score(result.posterior);
      const auto& expected = c.other_implementation.at(variant);
      const auto ratio = [&](double value, const char* key) {
        return value / expected.at(key).get<double>();
      };
      // The paper's densities are not the posterior, and the status says so.
      CHECK((result.status == UpdateStatus::kConverged || result.status == UpdateStatus::kNotGaussian));
      CHECK(result.steps == expected.at("steps").get<int>());
      // Eigenvectors of a scatter matrix with moments of 1e-6: 1e-10 relative in each step.
      CHECK(std::abs(ratio(score.rotation_error, "rot_mean_err_sigma") - 1.0) <= 1e-7);
      CHECK(std::abs(ratio(score.translation_error, "trans_mean_err_sigma") - 1.0) <= 1e-7);
      CHECK(std::abs(ratio(score.rotation_variance_ratio, "rot_var_ratio") - 1.0) <= 1e-7);
      // With coupling, it takes the fourth moments of the last samples for Cov(t), we those of the density.
      const double tolerance = options.keep_coupling ? 1e-4 : 1e-7;
      CHECK(std::abs(ratio(score.translation_variance_ratio, "trans_var_ratio") - 1.0) <= tolerance);
    };
    check("paper_base_indep", kPaperRule, as_there(0.05, false));
    check("base_corr", kPaperRule, as_there(0.05, true));
    check("deg5_indep", RichPoseRule{}, as_there(0.05, false));
    check("deg5_corr", RichPoseRule{}, as_there(0.05, true));
    check("deg5_corr_tau0.5", RichPoseRule{}, as_there(0.5, true));
  }
}

TEST_CASE("Small steps with degree-5 points and the coupling reach the true posterior",
          "[progressive][reference]") {
  for (const auto& c : progressive_cases()) {
    CAPTURE(c.name);
    const auto result = progressive_update(c.prior, c.log_likelihood, RichPoseRule{}, {.tau = 0.8});
    const Score score = c.score(result.posterior);
    CHECK(result.status == UpdateStatus::kConverged);
    CHECK_FALSE(result.step_floor_hit);
    CHECK(result.restarts == 0);
    CHECK(score.rotation_error <= 0.15);
    CHECK(score.translation_error <= 0.15);
    CHECK(score.rotation_variance_ratio >= 0.96);
    CHECK(score.rotation_variance_ratio <= 1.05);
    CHECK(score.translation_variance_ratio >= 0.96);
    CHECK(score.translation_variance_ratio <= 1.05);
    CHECK(std::abs(result.log_evidence - c.truth.log_evidence) <= 0.15);
  }
}

TEST_CASE("With a precise measurement the small steps are good to an eighth of a sigma",
          "[progressive][reference]") {
  for (const auto& c : progressive_cases()) {
    if (c.name.starts_with("exact_product") || c.weak_prior) continue;
    CAPTURE(c.name);
    const auto result = progressive_update(c.prior, c.log_likelihood, RichPoseRule{}, {.tau = 0.8});
    const Score score = c.score(result.posterior);
    CHECK(score.rotation_error <= 0.12);
    CHECK(score.rotation_variance_ratio >= 0.96);
    CHECK(score.rotation_variance_ratio <= 1.02);
  }
}

TEST_CASE("The default steps stay within a fifth of a sigma, for priors of 25 degrees, too",
          "[progressive][reference]") {
  for (const auto& c : progressive_cases()) {
    CAPTURE(c.name);
    const auto result = progressive_update(c.prior, c.log_likelihood, RichPoseRule{});
    const Score score = c.score(result.posterior);
    CHECK(score.rotation_error <= 0.2);
    CHECK(score.translation_error <= 0.2);
    CHECK(score.rotation_variance_ratio >= 0.84);
    CHECK(score.rotation_variance_ratio <= 1.05);
  }
}

TEST_CASE("The paper's points without the coupling are overconfident, and the status says so",
          "[progressive][reference]") {
  for (const auto& c : progressive_cases()) {
    if (c.name.starts_with("exact_product")) continue;
    CAPTURE(c.name);
    const auto result =
        progressive_update(c.prior, c.log_likelihood, kPaperRule, {.tau = 0.05, .keep_coupling = false});
    const Score score = c.score(result.posterior);
    CHECK(result.status != UpdateStatus::kConverged);
    CHECK(score.rotation_error >= 0.7);
    CHECK(score.rotation_variance_ratio <= 0.21);
  }
}

TEST_CASE("Where orientation and translation are independent the coupling changes nothing",
          "[progressive][reference]") {
  for (const auto& c : progressive_cases()) {
    if (!c.name.starts_with("exact_product")) continue;
    CAPTURE(c.name);
    const auto with = progressive_update(c.prior, c.log_likelihood, RichPoseRule{}, {.keep_coupling = true});
    const auto without =
        progressive_update(c.prior, c.log_likelihood, RichPoseRule{}, {.keep_coupling = false});
    CHECK(with.posterior.coupling().norm() * std::sqrt(with.posterior.orientation().second_moments()[2]) <=
          1e-9 * std::sqrt(with.posterior.translation_covariance().norm()));
    CHECK(max_difference(with.posterior.orientation().scatter(), without.posterior.orientation().scatter()) <=
          1e-12);
    CHECK(max_difference(with.posterior.mean_translation(), without.posterior.mean_translation()) <= 1e-9);
  }
}

TEST_CASE("Error and evidence converge as the steps shrink", "[progressive][reference]") {
  for (const auto& c : progressive_cases()) {
    if (c.name != "exact_product 1" && c.name != "exact_product 3") continue;  // the concentrated ones
    CAPTURE(c.name);
    // First order in the step, and thus in log(tau): a step four times smaller is four times better.
    const auto coarse = progressive_update(c.prior, c.log_likelihood, RichPoseRule{}, {.tau = 0.8});
    const auto fine =
        progressive_update(c.prior, c.log_likelihood, RichPoseRule{}, {.tau = std::pow(0.8, 0.25)});
    const auto shrinks = [](double fine_error, double coarse_error) {
      return std::abs(fine_error) <= 0.3 * std::abs(coarse_error);
    };
    CHECK(shrinks(c.score(fine.posterior).translation_error, c.score(coarse.posterior).translation_error));
    CHECK(shrinks(c.score(fine.posterior).translation_variance_ratio - 1.0,
                  c.score(coarse.posterior).translation_variance_ratio - 1.0));
    CHECK(shrinks(fine.log_evidence - c.truth.log_evidence, coarse.log_evidence - c.truth.log_evidence));
    CHECK(std::abs(fine.log_evidence - c.truth.log_evidence) <= 0.01);
  }
}
