// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <antipode/detail/products.hpp>
#include <antipode/distributions/bingham.hpp>

#include "distributions/random_densities.hpp"
#include "distributions/sphere_quadrature.hpp"
#include "support/catch.hpp"
#include "support/error_message.hpp"

using namespace antipode;
using namespace antipode::test;

TEST_CASE("The density integrates to one and has the reported moments", "[bingham]") {
  for (unsigned seed = 0; seed < 3; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto b = random_bingham<double, 4>(rng, -1.0, 1.5);
    const auto density = [&](const Vector4<double>& q) { return std::exp(b.log_density(q)); };
    CHECK(std::abs(integrate_over_s3(density, 0.0) - 1.0) <= 1e-11);
    const auto scatter = [&](const Vector4<double>& q) -> Matrix4<double> {
      return density(q) * q * q.transpose();
    };
    CHECK(max_difference(integrate_over_s3(scatter, Matrix4<double>::Zero().eval()), b.scatter()) <= 1e-11);
    const auto fourth = [&](const Vector4<double>& q) -> Matrix4<double> {
      const Vector4<double> squares = (b.axes().transpose() * q).cwiseAbs2();
      return density(q) * squares * squares.transpose();
    };
    CHECK(max_difference(integrate_over_s3(fourth, Matrix4<double>::Zero().eval()), b.fourth_moments()) <=
          1e-11);
    const auto surprise = [&](const Vector4<double>& q) { return -density(q) * b.log_density(q); };
    CHECK(std::abs(integrate_over_s3(surprise, 0.0) - b.entropy()) <= 1e-10);
  }
}

TEMPLATE_TEST_CASE("The density ignores the sign, bit for bit", "[bingham][law]", float, double) {
  for (unsigned seed = 0; seed < 100; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto b = random_bingham<TestType, 4>(rng, -3.0, 8.0);
    const Vector4<TestType> q = random_quaternion<TestType>(rng);
    CHECK(b.log_density(q) == b.log_density(-q));
  }
}

TEMPLATE_TEST_CASE("Order, shift and axis signs of the parameters do not matter", "[bingham][law]", float,
                   double) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto b = random_bingham<TestType, 4>(rng, -2.0, 2.0);
    Matrix4<TestType> axes;
    Vector4<TestType> z;
    for (int i = 0; i < 4; ++i) {
      axes.col(i) = b.axes().col(3 - i);
      z[i] = b.concentrations()[3 - i] + TestType(5);
    }
    axes.col(1) *= TestType(-1);
    const auto c = Bingham<TestType, 4>::from_parameters(axes, z);
    const double tolerance = 10 * kEpsilon<TestType> * (5.0 - static_cast<double>(b.concentrations()[0]));
    CHECK(c.concentrations()[3] == TestType(0));
    CHECK(max_difference(c.concentrations(), b.concentrations()) <= tolerance);
    CHECK(max_difference(c.scatter(), b.scatter()) <= tolerance);
    const Vector4<TestType> q = random_quaternion<TestType>(rng);
    CHECK(static_cast<double>(std::abs(c.log_density(q) - b.log_density(q))) <= 2 * tolerance);
  }
}

TEMPLATE_TEST_CASE_SIG("The parameter matrix determines the density up to a multiple of the identity",
                       "[bingham][law]", ((class Scalar, int Dim), Scalar, Dim), (float, 4), (double, 4),
                       (double, 5)) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto b = random_bingham<Scalar, Dim>(rng, -2.0, 2.0);
    Matrix<Scalar, Dim> C = b.parameter_matrix();
    for (int i = 0; i < Dim; ++i) C(i, i) += Scalar(3);
    const auto c = Bingham<Scalar, Dim>::from_matrix(C);
    const double tolerance = 20 * kEpsilon<Scalar> * (5.0 - static_cast<double>(b.concentrations()[0]));
    CHECK(max_difference(c.concentrations(), b.concentrations()) <= tolerance);
    CHECK(max_difference(c.scatter(), b.scatter()) <= tolerance);
  }
}

TEST_CASE("The product is Bayes' rule", "[bingham][law]") {
  for (unsigned seed = 0; seed < 3; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto prior = random_bingham<double, 4>(rng, -1.0, 1.2);
    const auto likelihood = random_bingham<double, 4>(rng, -1.0, 1.2);
    const auto posterior = prior.product(likelihood);
    const auto joint = [&](const Vector4<double>& q) {
      return std::exp(prior.log_density(q) + likelihood.log_density(q));
    };
    const double evidence = integrate_over_s3(joint, 0.0);
    const auto scatter = [&](const Vector4<double>& q) -> Matrix4<double> {
      return joint(q) / evidence * q * q.transpose();
    };
    CHECK(max_difference(integrate_over_s3(scatter, Matrix4<double>::Zero().eval()), posterior.scatter()) <=
          1e-11);
    const Vector4<double> q = random_quaternion<double>(rng);
    CHECK(std::abs(std::log(joint(q) / evidence) - posterior.log_density(q)) <= 1e-10);
    CHECK(max_difference(likelihood.product(prior).scatter(), posterior.scatter()) <= 1e-14);
  }
}

TEST_CASE("A product that is too concentrated is refused", "[bingham][error]") {
  const auto narrow = Bingham<double, 4>::from_parameters(Matrix4<double>::Identity(),
                                                          Vector4<double>(-9e14, -9e14, -9e14, 0));
  CHECK(contains(error_message([&] { (void)narrow.product(narrow); }), "more than 1e15 apart"));
}

TEMPLATE_TEST_CASE("The uniform density is neutral in products", "[bingham][law]", float, double) {
  Rng rng(5);
  const auto b = random_bingham<TestType, 4>(rng, -1.0, 2.0);
  const auto c = b.product(Bingham<TestType, 4>::uniform());
  CHECK(max_difference(c.scatter(), b.scatter()) <= 100 * kEpsilon<TestType>);
}

TEMPLATE_TEST_CASE("The divergence is positive, and zero from a density to itself", "[bingham][law]", float,
                   double) {
  for (unsigned seed = 0; seed < 100; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto f = random_bingham<TestType, 4>(rng, -3.0, 4.0);
    const auto g = random_bingham<TestType, 4>(rng, -3.0, 4.0);
    CHECK(f.kl_divergence(g) > TestType(0));
    CHECK(static_cast<double>(f.kl_divergence(f)) <= 50 * kEpsilon<TestType>);
    const auto same = Bingham<TestType, 4>::from_parameters(g.axes(), g.concentrations());
    const auto flipped = Bingham<TestType, 4>::from_parameters(-g.axes(), g.concentrations());
    CHECK(f.kl_divergence(flipped) == f.kl_divergence(same));
  }
}

TEST_CASE("The divergence is the mean log ratio", "[bingham]") {
  Rng rng(2);
  const auto f = random_bingham<double, 4>(rng, -1.0, 1.2), g = random_bingham<double, 4>(rng, -1.0, 1.2);
  const auto log_ratio = [&](const Vector4<double>& q) {
    return std::exp(f.log_density(q)) * (f.log_density(q) - g.log_density(q));
  };
  CHECK(std::abs(integrate_over_s3(log_ratio, 0.0) - f.kl_divergence(g)) <= 1e-10);
}

TEST_CASE("The uniform density has the log area of the sphere as entropy", "[bingham]") {
  CHECK(std::abs(Bingham<double, 4>::uniform().entropy() -
                 std::log(2.0 * std::numbers::pi * std::numbers::pi)) <= 1e-14);
  CHECK(Bingham<double, 4>::uniform().kl_divergence(Bingham<double, 4>::uniform()) == 0.0);
}

TEMPLATE_TEST_CASE("A rotated density has rotated arguments", "[bingham][law]", float, double) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto b = random_bingham<TestType, 4>(rng, -2.0, 2.0);
    const Vector4<TestType> a = random_quaternion<TestType>(rng), q = random_quaternion<TestType>(rng);
    const double tolerance = 20 * kEpsilon<TestType> * (1.0 - static_cast<double>(b.concentrations()[0]));
    const TestType expected = b.log_density(q);
    CHECK(static_cast<double>(std::abs(compose(a, b).log_density(hamilton_product(a, q)) - expected)) <=
          tolerance);
    CHECK(static_cast<double>(std::abs(compose(b, a).log_density(hamilton_product(q, a)) - expected)) <=
          tolerance);
    const Matrix4<TestType> identity = Matrix4<TestType>::Identity();
    CHECK(b.transformed(-identity).log_density(q) == b.transformed(identity).log_density(q));
  }
}

TEST_CASE("The composition of independent rotations has the exact scatter", "[bingham][law]") {
  // E[(ab)(ab)^T] = sum over the eigenvectors of both scatters, an exact cubature of the quadratic integrand.
  for (unsigned seed = 0; seed < 50; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto a = random_bingham<double, 4>(rng, -2.0, 4.0), b = random_bingham<double, 4>(rng, -2.0, 4.0);
    Matrix4<double> expected = Matrix4<double>::Zero();
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) {
        const Vector4<double> q = hamilton_product(a.axes().col(i), b.axes().col(j));
        detail::add_outer_product(a.second_moments()[i] * b.second_moments()[j], q, q, expected);
      }
    }
    // The moments are solved for to 1e-13; as much again for the eigenvectors.
    CHECK(max_difference(compose(a, b).scatter(), expected) <= 2e-13);
  }
}

TEMPLATE_TEST_CASE("Composing with a certain rotation is a rotation of the density", "[bingham][law]", float,
                   double) {
  Rng rng(3);
  const auto b = random_bingham<TestType, 4>(rng, 0.0, 2.0);
  const Vector4<TestType> a = random_quaternion<TestType>(rng);
  const auto certain = Bingham<TestType, 4>::from_mode_covariance(a, Matrix3<TestType>::Zero());
  const double spread = 10.0 * static_cast<double>(certain.second_moments()[2]) + 50 * kEpsilon<TestType>;
  CHECK(max_difference(compose(certain, b).scatter(), compose(a, b).scatter()) <= spread);
  CHECK(max_difference(compose(b, certain).scatter(), compose(b, a).scatter()) <= spread);
}

TEMPLATE_TEST_CASE("Composition with the uniform density is uniform", "[bingham]", float, double) {
  Rng rng(4);
  const auto b = random_bingham<TestType, 4>(rng, 0.0, 5.0);
  const auto c = compose(b, Bingham<TestType, 4>::uniform());
  CHECK(static_cast<double>(c.concentrations().cwiseAbs().maxCoeff()) <= 100 * kEpsilon<TestType>);
}

TEMPLATE_TEST_CASE("Axes within 1e-6 of orthonormal are made so", "[bingham]", float, double) {
  Rng rng(6);
  const Matrix4<TestType> skewed =
      random_orthogonal<TestType, 4>(rng) + random_matrix<TestType, 4>(rng, 1e-7);
  const auto b = Bingham<TestType, 4>::from_parameters(skewed, Vector4<TestType>::Zero());
  const Matrix4<TestType> identity = b.axes().transpose().lazyProduct(b.axes());
  CHECK(max_difference(identity, Matrix4<TestType>::Identity()) <= 8 * kEpsilon<TestType>);
  CHECK(max_difference(b.axes(), skewed) <= 1e-6);
}

TEMPLATE_TEST_CASE("The most concentrated densities still have their moments", "[bingham]", float, double) {
  const auto b = Bingham<TestType, 4>::from_parameters(
      Matrix4<TestType>::Identity(),
      Vector4<TestType>(TestType(-1e8), TestType(-1e8), TestType(-1e8), TestType(0)));
  for (int i = 0; i < 3; ++i) {
    CHECK(std::abs(static_cast<double>(b.second_moments()[i]) / 5e-9 - 1.0) <= 1e-7 + kEpsilon<TestType>);
  }
  CHECK(std::isfinite(b.entropy()));
  CHECK(b.log_density(b.mode()) == -b.log_normalizer());
}

TEMPLATE_TEST_CASE("Invalid parameters are refused with their value", "[bingham][error]", float, double) {
  using Density = Bingham<TestType, 4>;
  constexpr TestType kNan = std::numeric_limits<TestType>::quiet_NaN();
  const Matrix4<TestType> I = Matrix4<TestType>::Identity();
  const Vector4<TestType> z(TestType(-3), TestType(-2), TestType(-1), TestType(0));
  const auto message = [](const Matrix4<TestType>& axes, const Vector4<TestType>& concentrations) {
    return error_message([&] { return Density::from_parameters(axes, concentrations); });
  };
  Matrix4<TestType> M = I;
  M(0, 1) = TestType(0.01);
  CHECK(contains(message(M, z), "not orthonormal: [1, 0.01"));
  M(0, 1) = kNan;
  CHECK(contains(message(M, z), "not orthonormal"));
  CHECK(contains(message(I * TestType(2), z), "not orthonormal"));
  CHECK(contains(message(Matrix4<TestType>::Zero(), z), "not orthonormal"));
  Vector4<TestType> bad = z;
  bad[2] = kNan;
  CHECK(contains(message(I, bad), "not finite: [-3; -2; "));
  bad[2] = -std::numeric_limits<TestType>::infinity();
  CHECK(contains(message(I, bad), "not finite"));
  bad[2] = TestType(-1e16);
  CHECK(contains(message(I, bad), "apart"));
  M = I;
  M(0, 1) = TestType(1);
  CHECK(contains(error_message([&] { return Density::from_matrix(M); }), "not symmetric: [1, 1"));
  M(0, 1) = kNan;
  CHECK(contains(error_message([&] { return Density::from_matrix(M); }), "not finite"));
  CHECK(contains(error_message([&] { return Density::uniform().transformed(I * TestType(1.1)); }),
                 "orthonormal"));
}

TEMPLATE_TEST_CASE("Draws have the second moments", "[bingham][random]", float, double) {
  constexpr int kDraws = 20000;
  for (unsigned seed = 0; seed < 6; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto b = seed == 0 ? Bingham<TestType, 4>::uniform()
                             : random_bingham<TestType, 4>(rng, -2.0, seed < 4 ? 2.0 : 8.0);
    const Matrix4<double> fourth = b.fourth_moments().template cast<double>();
    const Vector4<double> omega = b.second_moments().template cast<double>();
    Matrix4<double> sum = Matrix4<double>::Zero();
    int positive = 0;
    for (int k = 0; k < kDraws; ++k) {
      const Vector4<TestType> q = b.sample(rng);
      REQUIRE(static_cast<double>(std::abs(q.norm() - TestType(1))) <= 8 * kEpsilon<TestType>);
      const Vector4<double> x = (b.axes().transpose() * q).template cast<double>();
      sum += x * x.transpose();
      positive += x[3] > 0.0;
    }
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) {
        // Five standard errors of the mean of x_i x_j.
        const double expected = i == j ? omega[i] : 0.0;
        const double variance = std::max(0.0, fourth(i, j) - expected * expected) + 1e-12;
        CHECK(std::abs(sum(i, j) / kDraws - expected) <=
              5.0 * std::sqrt(variance / kDraws) + 10 * kEpsilon<TestType>);
      }
    }
    CHECK(std::abs(positive - kDraws / 2) <= 5 * std::sqrt(kDraws) / 2);
  }
}

TEST_CASE("The envelope of the rejection covers the density", "[bingham][random]") {
  for (unsigned seed = 0; seed < 200; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const Vector4<double> a = -random_concentrations<double, 4>(rng, -3.0, 8.0);
    const detail::BinghamRejection<double, 4> rejection(a);
    for (int k = 0; k < 20; ++k) {
      const Vector4<double> x =
          random_unit<double, 4>(rng).cwiseQuotient((1.0 + a.array()).sqrt().matrix()).normalized();
      const double p = rejection.acceptance(x);
      CHECK(p >= 0.0);
      CHECK(p <= 1.0 + 1e-12);
    }
  }
}
