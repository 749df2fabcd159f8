// SPDX-License-Identifier: MIT
#include <numbers>

#include <antipode/geometry/rotation_integrals.hpp>
#include <antipode/testing/check_jacobian.hpp>

#include "support/catch.hpp"
#include "support/matrix_exponential.hpp"
#include "support/random.hpp"

namespace antipode::test {
namespace {

const double kAngles[] = {0.0, 1e-9, 0.0999, 0.1001, 0.999, 1.001, std::numbers::pi, 2 * std::numbers::pi,
                          20.0};

}  // namespace

TEST_CASE("Integrals of a rotation are blocks of a matrix exponential", "[rotation_integrals]") {
  for (const double angle : kAngles) {
    CAPTURE(angle);
    Rng rng(1);
    const Vector3<double> phi = angle * random_unit<double, 3>(rng);
    // exp of [P I 0; 0 0 I; 0 0 0] has the integrals in its first rows.
    Matrix<double, 9> A = Matrix<double, 9>::Zero();
    A.topLeftCorner<3, 3>() = skew(phi);
    A.block<3, 3>(0, 3).setIdentity();
    A.block<3, 3>(3, 6).setIdentity();
    const Matrix<double, 9> E = matrix_exponential<9>(A);
    const auto [first, second] = rotation_integrals(phi);
    CHECK(max_difference(first, E.block<3, 3>(0, 3)) <= 1e-14);
    CHECK(max_difference(second, E.block<3, 3>(0, 6)) <= 1e-14);
    CHECK(max_difference(first, so3_left_jacobian(phi)) == 0.0);
    const auto in_float = rotation_integrals<float>(phi.cast<float>());
    CHECK(max_difference(in_float.second, second) <= 4e-7 * (1.0 + angle));  // phi is rounded, too
  }
}

TEST_CASE("Slopes of the integrals are their derivatives", "[rotation_integrals]") {
  for (const double angle : kAngles) {
    CAPTURE(angle);
    Rng rng(2);
    const Vector3<double> phi = angle * random_unit<double, 3>(rng);
    const Vector3<double> v = random_matrix<double, 3, 1>(rng, 10.0);
    const auto [first, second] = rotation_integrals_along(phi, v);
    CHECK(testing::check_jacobian(
        [&](const Vector3<double>& x) { return Vector3<double>(rotation_integrals(x).first * v); }, phi,
        first));
    CHECK(testing::check_jacobian(
        [&](const Vector3<double>& x) { return Vector3<double>(rotation_integrals(x).second * v); }, phi,
        second));
  }
}

TEST_CASE("Series and closed forms of the integrals meet", "[rotation_integrals]") {
  const auto below = detail::second_integral_coefficients(1.0 - 1e-15);
  const auto above = detail::second_integral_coefficients(1.0);
  CHECK(std::abs(below.c / above.c - 1.0) <= 20 * kEpsilon<double>);  // 12 epsilon, and the step
  CHECK(std::abs(below.c_slope / above.c_slope - 1.0) <=
        1000 * kEpsilon<double>);  // 360 epsilon by each term
}

}  // namespace antipode::test
