// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <antipode/detail/products.hpp>
#include <antipode/distributions/bingham.hpp>

#include "distributions/random_densities.hpp"
#include "support/catch.hpp"
#include "support/csv.hpp"
#include "support/error_message.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

template <class Scalar>
Matrix4<Scalar> diagonal(double a, double b, double c, double d) {
  Matrix4<Scalar> S = Matrix4<Scalar>::Zero();
  for (int i = 0; i < 4; ++i) S(i, i) = static_cast<Scalar>(Vector4<double>(a, b, c, d)[i]);
  return S;
}

/// The moments are solved for to 1e-13; as much again for the eigenvectors, and the rounding of the scalar.
template <class Scalar>
constexpr double kMomentTolerance = 2e-13 + 30 * kEpsilon<Scalar>;

/// Of concentrations whose smallest moment is omega: z ~ -1/(2 omega), up to twice that slope near the
/// uniform density, and the shift by the largest.
template <class Scalar>
double concentration_tolerance(double omega) {
  return 4.0 * kMomentTolerance<Scalar> / (2.0 * omega * omega);
}

}  // namespace

TEST_CASE("Fitted concentrations agree with 35-digit values", "[bingham][fit][oracle]") {
  const auto rows = read_csv("bingham_mle_s3.csv");
  REQUIRE(rows.size() == 36);
  for (const auto& row : rows) {
    Vector4<double> omega = Eigen::Map<const Vector4<double>>(row.data());
    Vector4<double> z = Eigen::Map<const Vector4<double>>(row.data() + 4);
    CAPTURE(omega.transpose());
    omega /= omega.sum();
    std::sort(z.begin(), z.end());
    const auto b =
        Bingham<double, 4>::from_moments(Matrix4<double>::Identity(), omega, {.min_eigenvalue = 0.0});
    for (int i = 0; i < 4; ++i) {
      CHECK(std::abs(b.concentrations()[i] - z[i]) <= 1e-9 * (1.0 + std::abs(z[i])));
    }
  }
}

TEMPLATE_TEST_CASE_SIG("A fit to the scatter of a density gives the density back", "[bingham][fit][law]",
                       ((class Scalar, int Dim), Scalar, Dim), (float, 4), (double, 2), (double, 3),
                       (double, 4), (double, 8)) {
  for (unsigned seed = 0; seed < 40; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto b = random_bingham<Scalar, Dim>(rng, -2.0, 2.0);
    const auto c = Bingham<Scalar, Dim>::fit(b.scatter());
    CHECK(max_difference(c.scatter(), b.scatter()) <= kMomentTolerance<Scalar>);
    CHECK(max_difference(c.concentrations(), b.concentrations()) <=
          concentration_tolerance<Scalar>(static_cast<double>(b.second_moments()[0])));
    CHECK(c.concentrations()[Dim - 1] == Scalar(0));
    CHECK(std::is_sorted(c.concentrations().begin(), c.concentrations().end()));
  }
}

TEST_CASE("Concentrations follow from the moments to 1e-11 from uniform to -1e12", "[bingham][fit][law]") {
  for (unsigned seed = 0; seed < 1000; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto b = random_bingham<double, 4>(rng, -6.0, 12.0);
    const auto c = Bingham<double, 4>::from_moments(b.axes(), b.second_moments(), {.min_eigenvalue = 0.0});
    CHECK(max_relative_difference(c.second_moments(), b.second_moments()) <= 1e-12);
    for (int i = 0; i < 4; ++i) {
      CHECK(std::abs(c.concentrations()[i] - b.concentrations()[i]) <=
            1e-11 * (1.0 + std::abs(b.concentrations()[i])));
    }
  }
}

TEMPLATE_TEST_CASE("Moments given in any order are sorted with their axes", "[bingham][fit]", float, double) {
  const Matrix4<TestType> expected = diagonal<TestType>(0.4, 0.1, 0.2, 0.3);
  const auto b = Bingham<TestType, 4>::from_moments(Matrix4<TestType>::Identity(), expected.diagonal());
  CHECK(max_difference(b.scatter(), expected) <= kMomentTolerance<TestType>);
  CHECK(max_difference(b.mode(), Vector4<TestType>::Unit(0)) <= kEpsilon<TestType>);
}

TEMPLATE_TEST_CASE("The uniform scatter gives the uniform density", "[bingham][fit]", float, double) {
  const auto b = Bingham<TestType, 4>::fit(diagonal<TestType>(0.25, 0.25, 0.25, 0.25));
  CHECK(b.concentrations().cwiseAbs().maxCoeff() <= TestType(1e-13));
  const auto near = Bingham<TestType, 4>::fit(diagonal<TestType>(0.249, 0.25, 0.25, 0.251));
  // z = 12 d(omega) to first order near the uniform density.
  CHECK(static_cast<double>(std::abs(near.concentrations()[0] + TestType(0.024))) <=
        2e-4 + 100 * kEpsilon<TestType>);
}

TEMPLATE_TEST_CASE("Equal eigenvalues give equal concentrations", "[bingham][fit]", float, double) {
  const auto b = Bingham<TestType, 4>::fit(diagonal<TestType>(0.125, 0.125, 0.375, 0.375));
  const auto& z = b.concentrations();
  CHECK(static_cast<double>(std::abs(z[1] - z[0])) <= concentration_tolerance<TestType>(0.125));
  CHECK(static_cast<double>(std::abs(z[2])) <= concentration_tolerance<TestType>(0.125));
}

TEMPLATE_TEST_CASE("Eigenvalues below the smallest allowed are raised to it", "[bingham][fit]", float,
                   double) {
  for (const double floor : {1e-6, 1e-4, 1e-2}) {
    CAPTURE(floor);
    const auto b = Bingham<TestType, 4>::fit(diagonal<TestType>(0.0, 0.0, 0.0, 1.0),
                                             {.min_eigenvalue = static_cast<TestType>(floor)});
    for (int i = 0; i < 3; ++i) {
      CHECK(std::abs(static_cast<double>(b.second_moments()[i]) * (1.0 + 3.0 * floor) / floor - 1.0) <=
            kMomentTolerance<TestType>);
    }
  }
  const auto certain = Bingham<double, 4>::fit(diagonal<double>(0.0, 0.0, 0.0, 1.0));
  CHECK(certain.concentrations()[0] == Approx(-1e8).epsilon(1e-6));
}

TEMPLATE_TEST_CASE("Invalid scatter matrices are refused with their value", "[bingham][fit][error]", float,
                   double) {
  using Density = Bingham<TestType, 4>;
  const auto message = [](const Matrix4<TestType>& S, const BinghamFitOptions<TestType>& options = {}) {
    return error_message([&] { return Density::fit(S, options); });
  };
  constexpr TestType kNan = std::numeric_limits<TestType>::quiet_NaN();
  Matrix4<TestType> S = diagonal<TestType>(0.1, 0.2, 0.3, 0.4);
  S(1, 1) = kNan;
  CHECK(contains(message(S), "not finite"));
  S = diagonal<TestType>(0.1, 0.2, 0.3, 0.4);
  S(0, 1) = TestType(0.05);
  CHECK(contains(message(S), "not symmetric"));
  CHECK(contains(message(diagonal<TestType>(0.1, 0.2, 0.3, 0.5)), "do not sum to one: [0.1"));
  CHECK(contains(message(diagonal<TestType>(-0.125, 0.25, 0.375, 0.5)), "is negative: [-0.125"));
  CHECK(contains(message(diagonal<TestType>(0.0, 0.25, 0.25, 0.5), {.min_eigenvalue = 0}), "singular"));
  CHECK(contains(message(S = diagonal<TestType>(0.1, 0.2, 0.3, 0.4), {.min_eigenvalue = TestType(-1)}),
                 "min_eigenvalue is not in [0, 1/Dim]: -1"));
  CHECK(contains(message(S, {.min_eigenvalue = TestType(0.5)}), "min_eigenvalue"));
  CHECK(contains(message(S, {.min_eigenvalue = kNan}), "min_eigenvalue"));
}

TEST_CASE("A rotation covariance becomes four times the moments of the quaternion's vector part",
          "[bingham][fit]") {
  for (unsigned seed = 0; seed < 50; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const Vector4<double> q = random_quaternion<double>(rng);
    const Matrix3<double> Sigma =
        std::pow(10.0, uniform<double>(rng, -6.0, -0.5)) * random_covariance<double, 3>(rng);
    const auto b = Bingham<double, 4>::from_mode_covariance(q, Sigma);
    CHECK(std::abs(std::abs(b.mode().dot(q)) - 1.0) <= 4 * kEpsilon<double>);
    const Matrix4<double> local = detail::congruence<double, 4, 4>(left_matrix(conjugate(q)), b.scatter());
    const Matrix3<double> four_times = 4.0 * local.bottomRightCorner<3, 3>();
    CHECK(max_difference(four_times, Sigma) <= kMomentTolerance<double>);
  }
}

TEMPLATE_TEST_CASE("A certain rotation is fitted with the smallest moments", "[bingham][fit]", float,
                   double) {
  const Vector4<TestType> q = Vector4<TestType>::Unit(0);
  const auto b = Bingham<TestType, 4>::from_mode_covariance(q, Matrix3<TestType>::Zero());
  CHECK(b.mode() == q);
  CHECK(b.second_moments()[0] > TestType(4e-9));
  CHECK(b.second_moments()[2] < TestType(2e-7));
}

TEST_CASE("A rotation covariance too wide for its mode is refused", "[bingham][fit][error]") {
  const Vector4<double> q = Vector4<double>::Unit(0);
  const auto fit = [&](const Vector3<double>& variances) {
    return Bingham<double, 4>::from_mode_covariance(q, Matrix3<double>(variances.asDiagonal()));
  };
  CHECK_NOTHROW(fit(Vector3<double>(0.99, 0.99, 0.99)));
  CHECK(contains(error_message([&] { return fit(Vector3<double>(1.01, 1.01, 1.01)); }), "too wide"));
  CHECK(contains(error_message([&] { return fit(Vector3<double>(0.1, -0.1, 0.1)); }), "negative"));
  const auto not_unit = [&] {
    return Bingham<double, 4>::from_mode_covariance(2.0 * q, 0.1 * Matrix3<double>::Identity());
  };
  CHECK(contains(error_message(not_unit), "not a unit quaternion"));
}
