// SPDX-License-Identifier: MIT
#include <cmath>
#include <limits>

#include <antipode/distributions/mixture_queries.hpp>
#include <antipode/distributions/projected_orientation.hpp>
#include <antipode/sampling/mixture_moments.hpp>

#include "distributions/random_mixtures.hpp"
#include "support/catch.hpp"
#include "support/error_message.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

using PushForwardMixture = Mixture<PushForwardGaussian<double>>;

/// The mean of f over draws of x, and the standard error of its entries.
template <int Dim>
struct Average {
  Vector<double, Dim> mean = Vector<double, Dim>::Zero(), error = Vector<double, Dim>::Zero();

  template <class Density, class Function>
  Average(const Density& x, const Function& f, unsigned seed) {
    Rng rng(seed);
    constexpr int kDraws = 40000;
    Vector<double, Dim> squares = Vector<double, Dim>::Zero();
    for (int k = 0; k < kDraws; ++k) {
      const Vector<double, Dim> value = f(x.sample(rng));
      mean += value / kDraws;
      squares += value.cwiseAbs2() / kDraws;
    }
    error = ((squares - mean.cwiseAbs2()) / kDraws).cwiseMax(0.0).cwiseSqrt();
  }
};

template <class X>
X wide_mixture(Rng& rng, int components) {
  return random_mixture<typename X::Component>(
      rng, components, random_pose<double>(rng),
      {.angle = 2.0, .distance = 2.0, .sigma_u = 0.3, .sigma_t = 0.5});
}

}  // namespace

TEMPLATE_TEST_CASE("Marginals have the moments of draws", "[mixture][queries][random]", PoseMixture,
                   PushForwardMixture) {
  Rng rng(1);
  const auto x = wide_mixture<TestType>(rng, 3);
  const auto t = translation_marginal(x);
  Vector3<double> mean = Vector3<double>::Zero();
  Matrix3<double> squares = Matrix3<double>::Zero();
  for (const auto& [weight, density] : t) {
    mean += weight * density.mean();
    squares += weight * density.covariance();
    detail::add_outer_product(weight, density.mean(), density.mean(), squares);
  }
  const Average<6> draws(
      x,
      [](const auto& pose) {
        const Vector3<double> p = pose.translation();
        return Vector6<double>(p[0], p[1], p[2], p[0] * p[0], p[0] * p[1], p[2] * p[2]);
      },
      2);
  const Vector6<double> expected(mean[0], mean[1], mean[2], squares(0, 0), squares(0, 1), squares(2, 2));
  for (int i = 0; i < 6; ++i) CHECK(std::abs(draws.mean[i] - expected[i]) <= 4.5 * draws.error[i]);
}

TEMPLATE_TEST_CASE("The orientation's marginal is the density with the translation integrated out",
                   "[mixture][queries]", PoseMixture, PushForwardMixture) {
  // Importance sampling from the translation's marginal, which is near the conditional density.
  Rng rng(3);
  const auto x = wide_mixture<TestType>(rng, 2);
  const auto orientation = orientation_marginal(x);
  const auto t = translation_marginal(x);
  for (int k = 0; k < 3; ++k) {
    const Vector4<double> q = x.sample(rng).rotation();
    const Average<1> integral(
        t,
        [&](const Vector3<double>& translation) {
          const auto pose = DualQuaternion<double>::from_rotation_translation(q, translation);
          return Vector<double, 1>(std::exp(x.log_density(pose) - t.log_density(translation)));
        },
        4);
    CHECK(std::abs(std::exp(orientation.log_density(q)) - integral.mean[0]) <= 4.5 * integral.error[0]);
    CHECK(orientation.log_density(-q) == orientation.log_density(q));
  }
}

TEMPLATE_TEST_CASE("The moments of a widely spread mixture are those of its draws",
                   "[mixture][queries][random]", PoseMixture, PushForwardMixture) {
  Rng rng(5);
  const auto x = random_mixture<typename TestType::Component>(
      rng, 4, random_pose<double>(rng), {.angle = 2.0, .distance = 2.0, .sigma_u = 0.1, .sigma_t = 0.5});
  const auto matched = moment_match(x);
  const Matrix4<double> scatter = matched.orientation().scatter();
  const Average<10> q(
      x,
      [](const auto& pose) {
        const Vector4<double> r = pose.rotation();
        Vector<double, 10> squares;
        for (int i = 0, k = 0; i < 4; ++i) {
          for (int j = 0; j <= i; ++j) squares[k++] = r[i] * r[j];
        }
        return squares;
      },
      6);
  for (int i = 0, k = 0; i < 4; ++i) {
    for (int j = 0; j <= i; ++j, ++k) {
      // A degree-5 rule is off by the order of sigma_u^6 in the second moments.
      CHECK(std::abs(scatter(i, j) - q.mean[k]) <= 4.5 * q.error[k] + 1e-4);
    }
  }
  const Average<6> t(
      x,
      [&](const auto& pose) {
        const Vector3<double> tau = matched.orientation_offset(pose.rotation());
        Vector6<double> values;
        values << pose.translation(), tau[0] * (pose.translation() - matched.mean_translation());
        return values;
      },
      7);
  const Matrix3<double> tu = matched.coupling() * matched.orientation_offset_variances().asDiagonal();
  for (int i = 0; i < 3; ++i) {
    CHECK(std::abs(matched.mean_translation()[i] - t.mean[i]) <= 4.5 * t.error[i]);
    // The variance of tau is that of the fitted Bingham density, not of the mixture.
    CHECK(std::abs(tu(i, 0) - t.mean[i + 3]) <= 4.5 * t.error[i + 3] + 0.2 * std::abs(tu(i, 0)));
  }
}

TEST_CASE("The moments of one concentrated component are its own", "[mixture][queries]") {
  Rng rng(8);
  const auto x = random_density_at(rng, random_pose<double>(rng), 1e-4, 0.1);
  const auto matched = moment_match(PoseMixture(x));
  CHECK(matched.pose().is_approx(x.pose(), 1e-8));
  const auto expected = to_pose_gaussian(x).covariance;
  const auto P = matched.covariance();
  for (int i = 0; i < 6; ++i) CHECK(P(i, i) == Approx(expected(i, i)).epsilon(1e-5));
}

TEMPLATE_TEST_CASE("No draw and no component's mode is denser than the mode", "[mixture][queries]",
                   PoseMixture, PushForwardMixture) {
  for (unsigned seed = 0; seed < 10; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto x = random_mixture<typename TestType::Component>(
        rng, 5, random_pose<double>(rng), {.angle = 0.3, .distance = 0.3, .sigma_u = 0.15, .sigma_t = 0.3});
    const auto peak = mode(x);
    CHECK(peak.log_density == x.log_density(peak.pose));
    CHECK(peak.iterations < 100);
    for (const auto& element : x) CHECK(x.log_density(element.density.pose()) <= peak.log_density);
    for (int k = 0; k < 300; ++k) CHECK(x.log_density(x.sample(rng)) <= peak.log_density);
    // A stationary point: going 1e-4 sigma away costs 5e-9 at least, either way.
    for (int i = 0; i < 6; ++i) {
      for (const double step : {-1e-3, 1e-3}) {
        CHECK(x.log_density(peak.pose.boxplus(Vector6<double>::Unit(i) * step)) < peak.log_density);
      }
    }
  }
}

TEST_CASE("The mode of one component is its own", "[mixture][queries]") {
  Rng rng(9);
  const auto x = random_density_at(rng, random_pose<double>(rng), 0.3, 1.0);
  CHECK(mode(PoseMixture(x)).pose.is_approx(x.pose(), 1e-12));
  CHECK_THROWS_AS(mode(PoseMixture(PoseComponent(x.pose(), Matrix6<double>::Zero()))), std::domain_error);
}

TEST_CASE("A path and a grid return the density at their poses", "[mixture][queries]") {
  Rng rng(10);
  const auto x = random_mixture(rng, 3, random_pose<double>(rng));
  const auto from = x.sample(rng), to = x.sample(rng);
  const auto path = log_density_on_path(x, from, to, 5);
  CHECK(path[0] == Approx(x.log_density(from)));
  CHECK(path[4] == Approx(x.log_density(to)));
  CHECK(path[2] == Approx(x.log_density(from.boxplus(0.5 * to.boxminus(from)))));

  const Vector6<double> a = random_twist<double>(rng, 0.1, 0.2), b = random_twist<double>(rng, 0.1, 0.2);
  const auto grid = log_density_on_grid(x, {from, a, b, 3, 5});
  CHECK(grid(1, 2) == Approx(x.log_density(from)));
  CHECK(grid(0, 4) == Approx(x.log_density(from.boxplus(b - a))));

  Matrix<double, 8, 2> poses;
  poses << from.coeffs(), -to.coeffs();
  const auto values = log_density_of(x, poses);
  CHECK(values[0] == x.log_density(from));
  CHECK(values[1] == x.log_density(to));
  CHECK(contains(error_message([&] { return log_density_on_path(x, from, to, 1); }), "two points"));
  CHECK(contains(error_message([&] { return log_density_on_grid(x, {from, a, b, 3, 1}); }), "two rows"));
}
