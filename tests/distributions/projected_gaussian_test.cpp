// SPDX-License-Identifier: MIT
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <utility>

#include <antipode/distributions/density.hpp>
#include <antipode/distributions/projected_gaussian.hpp>

#include "distributions/random_projected_gaussians.hpp"
#include "distributions/sphere_quadrature.hpp"
#include "support/catch.hpp"
#include "support/error_message.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

static_assert(Density<ProjectedGaussian<double>, DualQuaternion<double>>);
static_assert(Density<PushForwardGaussian<float>, DualQuaternion<float>>);

/// A density whose tangent point is not its mode.
template <class Density>
Density off_center(Rng& rng, double sigma_u) {
  using Scalar = typename Density::Scalar;
  Vector6<Scalar> mean = random_matrix<Scalar, 6, 1>(rng, 0.3);
  return Density(random_quaternion<Scalar>(rng), mean, random_tangent_covariance<Scalar>(rng, sigma_u, 1.0));
}

/// The marginal density of q: p(q, t) over that of t given q, at the conditional mean of t.
template <class Density>
double rotation_density(const Density& x, const Vector4<double>& q) {
  const auto u = detail::tangent_coordinates<double>(x.tangent_point(), q);
  if (!u) return 0.0;
  const auto& L = x.sqrt_factor();
  const Vector3<double> d = *u - x.mean().template head<3>();
  const Vector3<double> z = L.template topLeftCorner<3, 3>().template triangularView<Eigen::Lower>().solve(d);
  const Vector3<double> t = x.mean().template tail<3>() + L.template bottomLeftCorner<3, 3>() * z;
  const double peak =
      std::pow(2.0 * std::numbers::pi, -1.5) / L.template bottomRightCorner<3, 3>().diagonal().prod();
  return std::exp(x.log_density(DualQuaternion<double>::from_rotation_translation(q, t))) / peak;
}

/// E[r r^T] of r = q0* q, by Gauss-Legendre in z over +-7 standard deviations of u = L z.
template <class Density>
Matrix4<double> scatter_in_chart(const Density& x) {
  constexpr int kNodes = 48;
  constexpr bool kTilted = Density::kProjection == Projection::kRenormalized;
  std::array<std::pair<double, double>, kNodes> nodes;
  for (int i = 0; i < kNodes; ++i) {
    const auto [z, weight] = gauss_legendre(kNodes, i);
    nodes[static_cast<std::size_t>(i)] = {7.0 * z, weight * std::exp(-24.5 * z * z)};
  }
  const Matrix3<double> L = x.sqrt_factor().template topLeftCorner<3, 3>();
  Matrix4<double> scatter = Matrix4<double>::Zero();
  for (const auto& [z1, w1] : nodes) {
    for (const auto& [z2, w2] : nodes) {
      for (const auto& [z3, w3] : nodes) {
        const Vector3<double> u = L * Vector3<double>(z1, z2, z3);
        const double stretch = 1.0 + u.squaredNorm();
        const Vector4<double> r(1.0, u[0], u[1], u[2]);
        scatter += w1 * w2 * w3 / (kTilted ? stretch * stretch * stretch : stretch) * r * r.transpose();
      }
    }
  }
  return scatter / scatter.trace();
}

}  // namespace

TEMPLATE_TEST_CASE("The density integrates to one over the sphere", "[projected]", ProjectedGaussian<double>,
                   PushForwardGaussian<double>) {
  for (unsigned seed = 0; seed < 3; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto x = off_center<TestType>(rng, 0.4);
    const auto f = [&](const Vector4<double>& q) { return rotation_density(x, q.normalized()); };
    CHECK(std::abs(integrate_over_s3(f, 0.0) - 1.0) <= 1e-9);
  }
}

TEMPLATE_TEST_CASE("The push-forward is the renormalised density times (1 + |u|^2)^2 C", "[projected]", float,
                   double) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto x = off_center<ProjectedGaussian<TestType>>(rng, 0.3);
    const PushForwardGaussian<TestType> y(x);
    const auto pose = nearby_pose(rng, x.pose(), 0.5, 1.0);
    const double r = static_cast<double>(x.coordinates(pose).template head<3>().squaredNorm());
    const double expected = 2.0 * std::log1p(r) + std::log(x.hemisphere_mass());
    const double log_density = static_cast<double>(x.log_density(pose));
    CHECK(std::abs(static_cast<double>(y.log_density(pose)) - log_density - expected) <=
          20 * kEpsilon<TestType> * (1.0 + std::abs(log_density)));
  }
}

TEMPLATE_TEST_CASE("Neither the sign of a pose nor that of the tangent point changes a bit",
                   "[projected][law]", float, double) {
  for (unsigned seed = 0; seed < 100; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto x = off_center<ProjectedGaussian<TestType>>(rng, 0.4);
    const auto pose = random_pose<TestType>(rng);
    CHECK(x.log_density(DualQuaternion<TestType>::unchecked(-pose.coeffs())) == x.log_density(pose));
    const ProjectedGaussian<TestType> same(x.tangent_point(), x.mean(), x.covariance());
    CHECK(with_flipped_sign(x).log_density(pose) == same.log_density(pose));
  }
}

TEMPLATE_TEST_CASE("Coordinates and projection are inverse to each other", "[projected][law]", float,
                   double) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto x = off_center<ProjectedGaussian<TestType>>(rng, 0.4);
    const Vector6<TestType> y = random_matrix<TestType, 6, 1>(rng, 2.0);
    // The equator magnifies rounding by 1 + |u|^2.
    CHECK(max_difference(x.coordinates(x.project(y)), y) <= 200 * kEpsilon<TestType>);
  }
}

TEST_CASE("A rotation a half-turn away has no coordinates and no density", "[projected]") {
  Rng rng(1);
  const auto x = off_center<ProjectedGaussian<double>>(rng, 0.4);
  const Vector4<double> half_turn = hamilton_product(x.tangent_point(), Vector4<double>(0, 1, 0, 0));
  const auto pose = DualQuaternion<double>::from_rotation_translation(half_turn, Vector3<double>(1, 2, 3));
  CHECK(x.log_density(pose) == -std::numeric_limits<double>::infinity());
  CHECK(contains(error_message([&] { return x.coordinates(pose); }), "half-turn away"));
}

TEMPLATE_TEST_CASE("Changing the tangent space there and back changes nothing", "[projected][law]", float,
                   double) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto x = off_center<ProjectedGaussian<TestType>>(rng, 0.2);
    const auto there = nearby_pose(rng, x.pose(), 0.6, 0.0).rotation();
    for (const auto& same :
         {x.rebased(there).rebased(x.tangent_point()), x.centered().rebased(x.tangent_point()),
          x.rebased(there).rebased(there).rebased(x.tangent_point())}) {
      CHECK(max_difference(same.mean(), x.mean()) <= 30 * kEpsilon<TestType>);
      CHECK(max_difference(same.covariance(), x.covariance()) <= 50 * kEpsilon<TestType>);
    }
    CHECK(x.centered().is_centered());
    CHECK(x.centered().pose().is_approx(x.pose(), static_cast<TestType>(10 * kEpsilon<TestType>)));
  }
}

TEST_CASE("A concentrated density looks the same from any tangent space", "[projected]") {
  // The remainder J d rho, rho = r_v.d, is small against d: |r_v| sigma_u = 1.5e-5 here, times D^3 <= 4^3.
  for (unsigned seed = 0; seed < 20; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto x = random_density_at(rng, random_pose<double>(rng), 1e-4, 1.0);
    const auto moved = x.rebased(nearby_pose(rng, x.pose(), 0.3, 0.0).rotation());
    for (int k = 0; k < 10; ++k) {
      Rng draws(seed * 100 + static_cast<unsigned>(k));
      const auto pose = x.sample(draws);
      CHECK(std::abs(moved.log_density(pose) - x.log_density(pose)) <= 1e-2);
    }
  }
}

TEST_CASE("Sigma points carry a wide density better than the Jacobian", "[projected]") {
  Rng rng(7);
  const auto x = random_density_at<PushForwardGaussian<double>>(rng, random_pose<double>(rng), 0.35, 1.0);
  const auto q = nearby_pose(rng, x.pose(), 0.5, 0.0).rotation();
  const auto linear = x.rebased(q), unscented = x.rebased(q, Transport::kUnscented);
  Vector6<double> mean = Vector6<double>::Zero();
  constexpr int kDraws = 100000;
  for (int k = 0; k < kDraws; ++k) mean += linear.coordinates(x.sample(rng)) / kDraws;
  CHECK((unscented.mean() - mean).head<3>().norm() < 0.5 * (linear.mean() - mean).head<3>().norm());
}

TEMPLATE_TEST_CASE("Draws have the moments of the density", "[projected][random]", ProjectedGaussian<double>,
                   PushForwardGaussian<double>) {
  constexpr int kDraws = 40000;
  for (const double sigma : {0.05, 0.6, 3.0}) {
    CAPTURE(sigma);
    Rng rng(11);
    // Of moments over the sphere E[q q^T], as those of u exist only just where the density is wide.
    const TestType x(random_pose<double>(rng), random_tangent_covariance<double>(rng, sigma, 1.0));
    Matrix4<double> scatter = Matrix4<double>::Zero();
    for (int k = 0; k < kDraws; ++k) {
      const Vector4<double> q = hamilton_product(conjugate(x.tangent_point()), x.sample(rng).rotation());
      scatter += q * q.transpose() / kDraws;
    }
    const Matrix4<double> expected = scatter_in_chart(x);
    // An entry r_i r_j is at most 1 in size: five standard errors with its second moment.
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) {
        const double bound = std::sqrt(std::min(expected(i, i), expected(j, j)) / kDraws);
        CHECK(std::abs(scatter(i, j) - expected(i, j)) <= 5.0 * bound);
      }
    }
  }
}

TEST_CASE("Translations are drawn with the rotation they are correlated with", "[projected][random]") {
  Rng rng(12);
  const auto x = random_density_at<PushForwardGaussian<double>>(rng, random_pose<double>(rng), 0.3, 2.0);
  constexpr int kDraws = 40000;
  Matrix6<double> squares = Matrix6<double>::Zero();
  for (int k = 0; k < kDraws; ++k) {
    const Vector6<double> y = x.coordinates(x.sample(rng)) - x.mean();
    squares += y * y.transpose() / kDraws;
  }
  const Vector6<double> sigma = x.covariance().diagonal().cwiseSqrt();
  const Matrix6<double> difference =
      sigma.cwiseInverse().asDiagonal() * (squares - x.covariance()) * sigma.cwiseInverse().asDiagonal();
  CHECK(difference.cwiseAbs().maxCoeff() <= 5.0 * std::sqrt(2.0 / kDraws));
}

TEMPLATE_TEST_CASE("The tightest and the widest legal densities are finite everywhere", "[projected]", float,
                   double) {
  using Density = ProjectedGaussian<TestType>;
  Rng rng(13);
  const auto pose = random_pose<TestType>(rng);
  Vector6<TestType> wide = Vector6<TestType>::Constant(TestType(1e7));
  for (const Vector6<TestType>& variances :
       {Vector6<TestType>(Vector6<TestType>::Constant(TestType(1e-10))), wide}) {
    const Density x(pose, variances.asDiagonal());
    CHECK(std::isfinite(x.log_density(pose)));
    CHECK(x.log_density(pose) >= x.log_density(nearby_pose(rng, pose, 1e-4, 1e-4)));
    for (int k = 0; k < 20; ++k) {
      CHECK_FALSE(std::isnan(x.log_density(random_pose<TestType>(rng))));
      CHECK(x.sample(rng).coeffs().allFinite());
    }
  }
}

TEST_CASE("A nearly uniform density is that of the sphere", "[projected]") {
  Rng rng(14);
  Vector6<double> variances;
  variances << Vector3<double>::Constant(1e7), Vector3<double>::Ones();
  const ProjectedGaussian<double> x(random_pose<double>(rng), variances.asDiagonal());
  const auto t = x.pose().translation();
  const double log_peak = -1.5 * std::log(2.0 * std::numbers::pi);
  const double log_area = std::log(2.0 * std::numbers::pi * std::numbers::pi);
  for (int k = 0; k < 10; ++k) {
    const auto pose = DualQuaternion<double>::from_rotation_translation(random_quaternion<double>(rng), t);
    // Of |u| below 1000, whose Gaussian factor is exp(-0.05) at worst; most are below 10.
    CHECK(std::abs(x.log_density(pose) - log_peak + log_area) <= 0.06);
  }
}

TEST_CASE("A certain rotation has draws but no values", "[projected][error]") {
  Rng rng(15);
  const auto pose = random_pose<double>(rng);
  const ProjectedGaussian<double> x(pose, Matrix6<double>::Zero());
  CHECK(x.sample(rng).is_approx(pose, 1e-14));
  CHECK(x.hemisphere_mass() == Approx(1.0).margin(1e-14));
  CHECK_FALSE(x.positive_definite());
  CHECK_THROWS_AS(x.log_density(pose), std::domain_error);
}

TEST_CASE("The largest finite variance stays finite", "[projected]") {
  Matrix6<double> covariance = 0.01 * Matrix6<double>::Identity();
  covariance(5, 5) = std::numeric_limits<double>::max();
  const ProjectedGaussian<double> x(Vector4<double>::UnitX(), Vector6<double>::Zero(), covariance);
  CHECK(x.covariance() == covariance);
  CHECK(x.centered().covariance().allFinite());
}

TEMPLATE_TEST_CASE("Invalid arguments of a projected Gaussian are refused", "[projected][error]", float,
                   double) {
  using Density = ProjectedGaussian<TestType>;
  constexpr TestType kNan = std::numeric_limits<TestType>::quiet_NaN();
  const Vector4<TestType> q(1, 0, 0, 0);
  const Vector6<TestType> mean = Vector6<TestType>::Zero();
  const Matrix6<TestType> I = Matrix6<TestType>::Identity();
  const auto message = [](const Vector4<TestType>& point, const Vector6<TestType>& mu,
                          const Matrix6<TestType>& Sigma) {
    return error_message([&] { return Density(point, mu, Sigma); });
  };
  CHECK(message(q, mean, I) == "nothing thrown");
  CHECK(contains(message(TestType(2) * q, mean, I), "not a unit quaternion"));
  CHECK(contains(message(q * kNan, mean, I), "not a unit quaternion"));
  CHECK(contains(message(q, mean * kNan, I), "mean is not finite"));
  CHECK(contains(message(q, mean, I * kNan), "covariance is not finite"));
  CHECK(contains(message(q, mean, -I), "negative eigenvalue"));
  CHECK(contains(message(q, mean, I * TestType(1e9)), "spread too widely"));
  Matrix6<TestType> lopsided = I;
  lopsided(0, 4) = TestType(0.1);
  CHECK(contains(message(q, mean, lopsided), "not symmetric"));

  const Density x(q, mean, I * TestType(0.01));
  const auto to = [&](const Vector4<TestType>& point, Transport transport) {
    return error_message([&] { return x.rebased(point, transport); });
  };
  CHECK(contains(to(Vector4<TestType>(0, 1, 0, 0), Transport::kLinearized), "edge of the new tangent space"));
  CHECK(contains(to(Vector4<TestType>(TestType(0.6), TestType(0.8), 0, 0), Transport::kLinearized),
                 "nothing thrown"));
  CHECK(contains(to(Vector4<TestType>(TestType(0.1), TestType(0.994987437), 0, 0), Transport::kUnscented),
                 "edge of the new tangent space"));
}

TEST_CASE("Draws far off centre have the moments of the density, and take no longer", "[projected][random]") {
  // Where the mean is far off, g(u) = (1 + |u|^2)^-2 is e^(-4 log|u|) and nearly Gaussian: the mean moves by
  // S grad log g = -4 S mu / |mu|^2, and the covariance is S to the order of |S| / |mu|^2.
  Rng rng(16);
  constexpr int kDraws = 20000;
  for (const double distance : {5.0, 20.0, 1e3}) {
    CAPTURE(distance);
    Vector6<double> mean;
    mean << distance * Vector3<double>(2, -1, 2) / 3.0, 1, 2, 3;
    const Matrix6<double> S = random_tangent_covariance<double>(rng, 0.02 * distance, 1.0);
    const ProjectedGaussian<double> x(random_quaternion<double>(rng), mean, S);
    Vector6<double> sum = Vector6<double>::Zero();
    Matrix6<double> squares = Matrix6<double>::Zero();
    Vector6<double> expected = mean;
    expected -= S.leftCols<3>() * (4.0 / (distance * distance) * mean.head<3>());
    for (int k = 0; k < kDraws; ++k) {
      const Vector6<double> y = x.coordinates(x.sample(rng)) - expected;
      sum += y / kDraws;
      squares += y * y.transpose() / kDraws;
    }
    const Vector6<double> sigma = S.diagonal().cwiseSqrt();
    const double order = 4.0 * S.topLeftCorner<3, 3>().trace() / (distance * distance);
    CHECK((sum.array() / sigma.array()).abs().maxCoeff() <= 5.0 / std::sqrt(kDraws) + order);
    const Matrix6<double> difference =
        sigma.cwiseInverse().asDiagonal() * (squares - S) * sigma.cwiseInverse().asDiagonal();
    CHECK(difference.cwiseAbs().maxCoeff() <= 5.0 * std::sqrt(2.0 / kDraws) + order);
  }
}

TEST_CASE("Wide and singular densities far off centre are drawn from", "[projected][random]") {
  // E[q q^T] against the reweighted Gaussian, whose effective number of draws is checked.
  Rng rng(17);
  constexpr int kDraws = 20000;
  Vector6<double> mean;
  mean << 3, 0, 0, 0, 0, 0;
  for (const double flatness : {1.0, 0.0}) {
    Vector6<double> sigma;
    sigma << 2.0, 2.0 * flatness, 1.0, 1, 1, 1;
    const ProjectedGaussian<double> x(Vector4<double>(1, 0, 0, 0), mean, sigma.cwiseAbs2().asDiagonal());
    Matrix4<double> scatter = Matrix4<double>::Zero(), expected = Matrix4<double>::Zero();
    double weights = 0.0, squared_weights = 0.0;
    for (int k = 0; k < kDraws; ++k) {
      const Vector4<double> q = x.sample(rng).rotation();
      scatter += q * q.transpose() / kDraws;
    }
    for (int k = 0; k < 20 * kDraws; ++k) {
      Vector3<double> u;
      for (int i = 0; i < 3; ++i) u[i] = mean[i] + sigma[i] * std::normal_distribution<double>()(rng);
      const double weight = std::pow(1.0 + u.squaredNorm(), -2.0);
      const Vector4<double> q = Vector4<double>(1, u[0], u[1], u[2]).normalized();
      expected += weight * q * q.transpose();
      weights += weight;
      squared_weights += weight * weight;
    }
    REQUIRE(weights * weights / squared_weights > 0.5 * kDraws);
    CHECK(max_difference(scatter, Matrix4<double>(expected / weights)) <= 5.0 * std::sqrt(3.0 / kDraws));
  }
  // Certain, elongated, and 25 degrees short of a half-turn away.
  const ProjectedGaussian<double> certain(Vector4<double>(1, 0, 0, 0), 1e3 * mean, Matrix6<double>::Zero());
  CHECK(certain.sample(rng).is_approx(certain.pose(), 1e-12));
  Vector6<double> elongated;
  elongated << 1.0, 1e6, 1.0, 1, 1, 1;
  const ProjectedGaussian<double> streak(Vector4<double>(1, 0, 0, 0), 300.0 * mean, elongated.asDiagonal());
  for (int k = 0; k < 100; ++k) CHECK(streak.sample(rng).coeffs().allFinite());
}
