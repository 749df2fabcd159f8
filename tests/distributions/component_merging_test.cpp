// SPDX-License-Identifier: MIT
#include <cmath>

#include <antipode/distributions/component_merging.hpp>

#include "distributions/random_mixtures.hpp"
#include "support/catch.hpp"
#include "support/reference.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

using detail::TangentGaussian;

TangentGaussian<double> gaussian(const nlohmann::json& row, const char* mu, const char* Sigma) {
  return {to_vector<6>(row.at(mu)), to_matrix<6>(row.at(Sigma))};
}

double symmetric_kl(const TangentGaussian<double>& a, const TangentGaussian<double>& b) {
  return detail::symmetric_kl<double>(*detail::cholesky_factor(a.covariance),
                                      *detail::cholesky_factor(b.covariance), b.mean - a.mean);
}

}  // namespace

TEST_CASE("The symmetric divergence matches the reference", "[reduction][reference]") {
  const auto reference = read_reference("projected_gaussian.json");
  for (const auto& row : reference.at("skl")) {
    const double expected = row.at("skl").get<double>();
    const double value = symmetric_kl(gaussian(row, "mu1", "Sigma1"), gaussian(row, "mu2", "Sigma2"));
    CHECK(std::abs(value / expected - 1.0) <= 1e-10);
    const Vector4<double> q(1, 0, 0, 0);
    const auto a = gaussian(row, "mu1", "Sigma1"), b = gaussian(row, "mu2", "Sigma2");
    CHECK(symmetric_kl_divergence(PoseComponent(q, a.mean, a.covariance),
                                  PoseComponent(-q, b.mean, b.covariance)) ==
          Approx(expected).epsilon(1e-10));
  }
}

TEST_CASE("Merged moments and the bound of their divergence match the reference", "[reduction][reference]") {
  const auto reference = read_reference("projected_gaussian.json");
  for (const auto& row : reference.at("merge")) {
    const double w_1 = row.at("w1").get<double>(), w_2 = row.at("w2").get<double>();
    const auto y_1 = gaussian(row, "mu1", "Sigma1"), y_2 = gaussian(row, "mu2", "Sigma2");
    const auto merged = detail::merge(w_1, y_1, w_2, y_2);
    CHECK(max_difference(merged.mean, to_vector<6>(row.at("mu"))) <= 1e-14);
    CHECK(max_difference(merged.covariance, to_matrix<6>(row.at("Sigma"))) <= 1e-14);
    CHECK(std::abs(symmetric_kl(y_1, merged) / row.at("skl1").get<double>() - 1.0) <= 1e-10);
    CHECK(std::abs(symmetric_kl(merged, y_2) / row.at("skl2").get<double>() - 1.0) <= 1e-10);
    const Vector4<double> q(1, 0, 0, 0);
    const PoseComponent p_1(q, y_1.mean, y_1.covariance), p_2(q, y_2.mean, y_2.covariance);
    const detail::MergedPair<double> pair(w_1, p_1, w_2, p_2);
    const double bound = detail::merge_cost(MergeCriterion::kSymmetricKullbackLeibler, w_1, w_2, pair);
    CHECK(std::abs(bound / row.at("bound_tight").get<double>() - 1.0) <= 1e-10);
    // Merging and centring commute with the signs.
    const auto centered = merge(w_1, p_1, w_2, with_flipped_sign(p_2));
    CHECK(max_difference(centered.covariance(), merge(w_1, p_1, w_2, p_2).covariance()) <= 1e-15);
    CHECK(centered.is_centered());
  }
}

TEST_CASE("The cheap bound is below the cost of merging", "[reduction][law]") {
  for (unsigned seed = 0; seed < 200; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto pose = random_pose<double>(rng);
    const auto p_1 = random_density_at(rng, pose, 0.1, 0.3);
    const auto p_2 = random_density_at(rng, nearby_pose(rng, pose, 0.2, 1.0), 0.1, 0.3);
    const double w_1 = uniform<double>(rng, 0.01, 0.5), w_2 = uniform<double>(rng, 0.01, 0.5);
    const detail::MergedPair<double> pair(w_1, p_1, w_2, p_2);
    const double bound = detail::merge_cost_bound<double>(w_1, detail::TranslationMarginal<double>(p_1), w_2,
                                                          detail::TranslationMarginal<double>(p_2));
    const double runnalls = detail::merge_cost(MergeCriterion::kRunnalls, w_1, w_2, pair);
    CHECK(bound <= runnalls * (1.0 + 1e-12));
    CHECK(runnalls <= detail::merge_cost(MergeCriterion::kSymmetricKullbackLeibler, w_1, w_2, pair));
  }
}
