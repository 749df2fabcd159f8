// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <antipode/distributions/mixture_fit.hpp>

#include "distributions/random_mixtures.hpp"
#include "support/catch.hpp"
#include "support/error_message.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

using Component = PushForwardGaussian<double>;
using Fitted = Mixture<Component>;
using Poses = Matrix<double, 8, Eigen::Dynamic>;
using Weights = Vector<double, Eigen::Dynamic>;

constexpr int kSamples = 5000;
constexpr double kSigmaU = 0.15, kSigmaT = 0.4;  // 17 degrees about an axis, among poses in a cube of 2 m

Fitted planted_mixture(Rng& rng, int components) {
  std::vector<Fitted::Element> elements;
  for (int i = 0; i < components; ++i) {
    const auto mode = random_pose<double>(rng, 1.0);
    elements.push_back(
        {uniform<double>(rng, 0.5, 1.0), random_density_at<Component>(rng, mode, kSigmaU, kSigmaT)});
  }
  return Fitted::normalized(std::move(elements));
}

/// Draws of either sign.
Poses draw(const Fitted& x, int count, Rng& rng) {
  Poses poses(8, count);
  for (int k = 0; k < count; ++k) poses.col(k) = (k % 2 ? -1.0 : 1.0) * x.sample(rng).coeffs();
  return poses;
}

const Fitted::Element& nearest(const Fitted& x, const DualQuaternion<double>& pose) {
  return *std::min_element(x.begin(), x.end(), [&](const auto& a, const auto& b) {
    return a.density.pose().boxminus(pose).norm() < b.density.pose().boxminus(pose).norm();
  });
}

double log_likelihood(const Fitted& x, const Poses& poses) {
  double sum = 0.0;
  for (int k = 0; k < poses.cols(); ++k) {
    sum += x.log_density(DualQuaternion<double>::unchecked(poses.col(k)));
  }
  return sum;
}

}  // namespace

TEST_CASE("Planted mixtures of two to seven components are found by BIC", "[fit][random]") {
  int recovered = 0;
  for (unsigned seed = 0; seed < 20; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const Fitted x = planted_mixture(rng, 2 + static_cast<int>(seed % 6));
    const Poses poses = draw(x, kSamples, rng);
    const auto fit = fit_mixture_by_bic(poses, Weights::Ones(kSamples), 9, rng);
    CHECK(fit.converged);
    // A sum of kSamples terms of order ten.
    CHECK(fit.largest_decrease <= 10.0 * kSamples * kEpsilon<double> * 10.0);
    if (fit.mixture.size() != x.size()) continue;
    ++recovered;
    for (const auto& [weight, density] : x) {
      const auto& found = nearest(fit.mixture, density.pose());
      CHECK(std::abs(found.weight - weight) <= 0.03);
      // The error of a mean in units of its standard error, in the mean square of its six coordinates.
      const Vector6<double> error = found.density.coordinates(density.pose()) - found.density.mean();
      const Vector6<double> whitened = detail::solve_lower<double, 6, 1>(found.density.sqrt_factor(), error);
      CHECK(std::sqrt(whitened.squaredNorm() * weight * kSamples / 6.0) <= 2.0);
    }
  }
  CHECK(recovered >= 18);
}

TEST_CASE("The reported likelihood is that of the mixture, and better than the planted one's", "[fit]") {
  Rng rng(1);
  const Fitted x = planted_mixture(rng, 3);
  const Poses poses = draw(x, 2000, rng);
  const auto fit = fit_mixture(poses, Weights::Ones(2000), 3, rng);
  // The tangent points are within 1e-3 of the modes while EM runs, and moved there in the end.
  CHECK(std::abs(log_likelihood(fit.mixture, poses) - fit.log_likelihood) <= 0.05);
  CHECK(fit.log_likelihood > log_likelihood(x, poses));
  CHECK(fit.bic == Approx(-2.0 * fit.log_likelihood + 83.0 * std::log(2000.0)));
  for (const auto& element : fit.mixture) CHECK(element.density.is_centered());
}

TEST_CASE("A fit does not depend on signs and scales of weights, and repeats itself bit for bit", "[fit]") {
  Rng rng(2);
  const Fitted x = planted_mixture(rng, 3);
  const Poses poses = draw(x, 1000, rng);
  Poses canonical = poses;
  for (int k = 0; k < poses.cols(); k += 3) canonical.col(k) *= -1.0;
  const auto fit = [](const Poses& samples, double weight) {
    Rng engine(7);
    return fit_mixture(samples, Weights::Constant(samples.cols(), weight), 3, engine);
  };
  const auto first = fit(poses, 1.0), again = fit(poses, 1.0), other = fit(canonical, 3.0);
  REQUIRE(first.mixture.size() == 3);
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK(first.mixture[i].weight == again.mixture[i].weight);
    CHECK(first.mixture[i].density.covariance() == again.mixture[i].density.covariance());
    CHECK(first.mixture[i].weight == Approx(other.mixture[i].weight).epsilon(1e-9));
  }
  CHECK(first.log_likelihood == Approx(other.log_likelihood).epsilon(1e-9));
}

TEST_CASE("Single precision fits the same mixture", "[fit][float]") {
  Rng rng(9);
  const Fitted x = planted_mixture(rng, 2);
  const Poses poses = draw(x, 500, rng);
  const auto in_double = fit_mixture(poses, Weights::Ones(500), 2, rng);
  const auto in_float =
      fit_mixture(poses.cast<float>().eval(), Weights::Ones(500).cast<float>().eval(), 2, rng);
  REQUIRE(in_float.mixture.size() == 2);
  for (const auto& [weight, density] : in_float.mixture) {
    const auto& same = nearest(in_double.mixture, density.pose().cast<double>());
    // Convergence leaves 1e-3 of a standard deviation.
    CHECK(std::abs(static_cast<double>(weight) - same.weight) <= 1e-3);
    CHECK(density.pose().cast<double>().boxminus(same.density.pose()).norm() <= 1e-3);
  }
}

TEST_CASE("A sample with twice the weight counts as two", "[fit]") {
  Rng rng(3);
  const Fitted x = planted_mixture(rng, 1);
  const Poses poses = draw(x, 400, rng);
  Weights weights = Weights::Ones(400);
  weights.head(200).setConstant(2.0);
  Poses repeated(8, 600);
  repeated << poses, poses.leftCols(200);
  const auto weighted = fit_mixture(poses, weights, 1, rng);
  const auto explicit_copies = fit_mixture(repeated, Weights::Ones(600), 1, rng);
  CHECK(max_difference(weighted.mixture[0].density.covariance(),
                       explicit_copies.mixture[0].density.covariance()) <= 1e-6);
  CHECK(weighted.mixture[0].density.pose().is_approx(explicit_copies.mixture[0].density.pose(), 1e-6));
}

TEST_CASE("Samples that agree are fitted with the smallest spread", "[fit]") {
  Rng rng(4);
  const auto pose = random_pose<double>(rng);
  Poses poses(8, 20);
  for (int k = 0; k < 20; ++k) poses.col(k) = pose.coeffs();
  const auto fit = fit_mixture(poses, Weights::Ones(20), 1, rng);
  const auto& density = fit.mixture[0].density;
  CHECK(density.pose().is_approx(pose, 1e-12));
  CHECK(density.covariance()(0, 0) == Approx(1e-8).epsilon(1e-6));
  CHECK(density.positive_definite());
}

TEST_CASE("More components than the samples support are reduced", "[fit]") {
  Rng rng(5);
  const Fitted x = planted_mixture(rng, 1);
  const Poses poses = draw(x, 30, rng);
  const auto fit = fit_mixture(poses, Weights::Ones(30), 8, rng);
  CHECK(fit.mixture.size() < 8);
  CHECK(std::isfinite(fit.log_likelihood));
  CHECK(fit.reseeded + 8 - static_cast<int>(fit.mixture.size()) > 0);
  CHECK(fit_mixture_by_bic(poses, Weights::Ones(30), 8, rng).mixture.size() == 1);
}

TEST_CASE("A few samples give one component, whatever number is requested", "[fit]") {
  for (unsigned seed = 0; seed < 20; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const int count = 1 + static_cast<int>(seed % 6);
    Poses poses = draw(planted_mixture(rng, 2), count, rng);
    if (seed % 2) poses = poses.col(0).replicate(1, count).eval();
    const auto fit = fit_mixture(poses, Weights::Ones(count), static_cast<std::size_t>(count), rng);
    REQUIRE(fit.mixture.size() == 1);
    CHECK(std::isfinite(fit.log_likelihood));
    CHECK(fit.mixture[0].density.positive_definite());
  }
}

TEST_CASE("Poses a half-turn apart, as of a symmetric thing, are two components", "[fit]") {
  Rng rng(6);
  const auto pose = random_pose<double>(rng);
  Vector6<double> half_turn = Vector6<double>::Zero();
  half_turn[2] = std::numbers::pi;
  Poses poses(8, 400);
  for (int k = 0; k < 400; ++k) {
    const auto x = pose.boxplus(random_twist<double>(rng, uniform<double>(rng, 0.0, 0.1), 0.05));
    poses.col(k) = (k % 2 ? x.boxplus(half_turn) : x).coeffs();
  }
  const auto fit = fit_mixture_by_bic(poses, Weights::Ones(400), 4, rng);
  REQUIRE(fit.mixture.size() == 2);
  CHECK(fit.mixture[0].weight == Approx(0.5).margin(1e-6));
  CHECK(tangent_angle(fit.mixture[0].density, fit.mixture[1].density) ==
        Approx(std::numbers::pi / 2.0).margin(0.02));
}

TEST_CASE("Samples that determine no mixture are refused", "[fit][error]") {
  Rng rng(8);
  const Poses poses = draw(planted_mixture(rng, 1), 10, rng);
  const auto message = [&](const Weights& weights, std::size_t components,
                           const MixtureFitOptions& options = {}) {
    return error_message([&] { return fit_mixture(poses, weights, components, rng, options); });
  };
  CHECK(contains(message(Weights::Ones(10), 0), "a fit needs a component"));
  CHECK(contains(message(Weights::Ones(10), 11), "and a sample for each, components: 11"));
  CHECK(contains(message(Weights::Zero(10), 1), "positive sum"));
  CHECK(contains(message(Weights::Ones(9), 1), "one weight per sample"));
  CHECK(contains(message(Weights::Constant(10, std::numeric_limits<double>::quiet_NaN()), 1), "weights"));
  CHECK(contains(message(Weights::Ones(10), 1, {.restarts = 0}), "restarts and iterations"));
}
