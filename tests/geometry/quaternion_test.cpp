// SPDX-License-Identifier: MIT
#include <cmath>
#include <limits>
#include <numbers>

#include <antipode/geometry/quaternion.hpp>

#include "support/catch.hpp"
#include "support/error_message.hpp"
#include "support/random.hpp"

// Tolerances: products of unit quaternions lose a few rounding units; 8 epsilon bounds every single operation
// here, 32 epsilon those that pass through a rotation matrix or an arc tangent.

namespace antipode::test {
namespace {

constexpr unsigned kSeed = 1;
constexpr int kTrials = 200;

TEMPLATE_TEST_CASE("The units of the Hamilton algebra multiply as i j = k", "[quaternion]", float, double) {
  using Q = Vector4<TestType>;
  const Q one = Q::Unit(0), i = Q::Unit(1), j = Q::Unit(2), k = Q::Unit(3);
  CHECK(hamilton_product(i, j) == k);
  CHECK(hamilton_product(j, k) == i);
  CHECK(hamilton_product(k, i) == j);
  CHECK(hamilton_product(j, i) == -k);
  CHECK(hamilton_product(i, i) == -one);
  CHECK(hamilton_product(one, k) == k);
}

TEMPLATE_TEST_CASE("Left and right matrices multiply as quaternions do", "[quaternion][law]", float, double) {
  Rng rng(kSeed);
  CAPTURE(kSeed);
  for (int trial = 0; trial < kTrials; ++trial) {
    const auto a = random_quaternion<TestType>(rng), b = random_quaternion<TestType>(rng);
    const Vector4<TestType> ab = hamilton_product(a, b);
    CHECK(max_difference(left_matrix(a) * b, ab) <= 8 * kEpsilon<TestType>);
    CHECK(max_difference(right_matrix(b) * a, ab) <= 8 * kEpsilon<TestType>);
    CHECK(max_difference(hamilton_product(a, conjugate(a)), Vector4<TestType>::Unit(0)) <=
          8 * kEpsilon<TestType>);
    CHECK(max_difference(conjugate(ab), hamilton_product(conjugate(b), conjugate(a))) <=
          8 * kEpsilon<TestType>);
  }
}

TEMPLATE_TEST_CASE("Rotating by the matrix, the formula and the product q v q* is the same",
                   "[quaternion][law]", float, double) {
  Rng rng(kSeed);
  CAPTURE(kSeed);
  for (int trial = 0; trial < kTrials; ++trial) {
    const auto q = random_quaternion<TestType>(rng);
    const Vector3<TestType> v = random_matrix<TestType, 3, 1>(rng);
    const Vector4<TestType> pure(TestType(0), v[0], v[1], v[2]);
    const Vector4<TestType> product = hamilton_product(hamilton_product(q, pure), conjugate(q));
    CHECK(max_difference(rotate(q, v), product.template tail<3>()) <= 16 * kEpsilon<TestType>);
    CHECK(max_difference(rotation_matrix(q) * v, product.template tail<3>()) <= 16 * kEpsilon<TestType>);
    CHECK(rotate(q, v) == rotate(-q, v));
    CHECK(rotation_matrix(q) == rotation_matrix(-q));
  }
}

TEMPLATE_TEST_CASE("Expressions are accepted wherever vectors are", "[quaternion]", float, double) {
  Rng rng(kSeed);
  const auto q = random_quaternion<TestType>(rng);
  const Matrix4<TestType> A = left_matrix(q);
  const Vector4<TestType> Aq = A * q;
  CHECK(hamilton_product(A * q, -q) == hamilton_product(Aq, Vector4<TestType>(-q)));
  CHECK(rotate(A.col(0), A.template topRightCorner<3, 1>()) ==
        rotate(q, Vector3<TestType>(A.template topRightCorner<3, 1>())));
}

TEMPLATE_TEST_CASE("A rotation matrix gives its quaternion back at every angle", "[quaternion]", float,
                   double) {
  Rng rng(kSeed);
  CAPTURE(kSeed);
  for (const double angle : {0.0, 1e-8, 1e-3, 1.0, 2.0, 3.0, 3.14, std::numbers::pi}) {
    for (int trial = 0; trial < kTrials; ++trial) {
      const Vector3<TestType> axis = random_unit<TestType, 3>(rng);
      const Vector4<TestType> q = quaternion_exp(static_cast<TestType>(angle) * axis);
      const Vector4<TestType> back = quaternion_from_rotation_matrix(rotation_matrix(q));
      CAPTURE(angle, q.transpose(), back.transpose());
      CHECK(1 - std::abs(static_cast<double>(q.dot(back))) <= 32 * kEpsilon<TestType>);
      CHECK(std::min(max_difference(q, back), max_difference(q, -back)) <= 32 * kEpsilon<TestType>);
    }
  }
  for (int axis = 0; axis < 3; ++axis) {  // half turns about the axes: each takes another branch
    const Vector4<TestType> q = Vector4<TestType>::Unit(axis + 1);
    CHECK(quaternion_from_rotation_matrix(rotation_matrix(q)) == q);
  }
}

TEMPLATE_TEST_CASE("exp and log of quaternions are inverse up to pi", "[quaternion][law]", float, double) {
  Rng rng(kSeed);
  CAPTURE(kSeed);
  for (const double angle : {0.0, 1e-30, 1e-12, 1e-8, 1e-4, 0.0999, 0.1001, 1.0, 2.0, 3.0, 3.14}) {
    for (int trial = 0; trial < kTrials; ++trial) {
      const Vector3<TestType> phi = static_cast<TestType>(angle) * random_unit<TestType, 3>(rng);
      const Vector4<TestType> q = quaternion_exp(phi);
      CAPTURE(angle, phi.transpose());
      CHECK(std::abs(static_cast<double>(q.norm()) - 1) <= 4 * kEpsilon<TestType>);
      CHECK(max_difference(quaternion_log(q), phi) <= 8 * kEpsilon<TestType> * angle);
      CHECK(quaternion_log(q) == quaternion_log(-q));
    }
  }
}

TEMPLATE_TEST_CASE("At half a turn the logarithm has length pi and one sign for q and -q", "[quaternion]",
                   float, double) {
  Rng rng(kSeed);
  CAPTURE(kSeed);
  for (int trial = 0; trial < kTrials; ++trial) {
    Vector4<TestType> q = Vector4<TestType>::Zero();
    q.template tail<3>() = random_unit<TestType, 3>(rng);
    const Vector3<TestType> phi = quaternion_log(q);
    CHECK(static_cast<double>(phi.norm()) == Approx(std::numbers::pi).epsilon(4 * kEpsilon<TestType>));
    CHECK(phi == quaternion_log(-q));
  }
}

TEST_CASE("The canonical representative is the same for q and -q, and its first non-zero entry is positive",
          "[quaternion]") {
  for (const Vector4<double>& q : {Vector4<double>(-1, 2, 3, 4), Vector4<double>(0, -1, 0, 2),
                                   Vector4<double>(-0.0, 0, -3, 1), Vector4<double>(0, 0, 0, -1)}) {
    const Vector4<double> c = canonical(q);
    CHECK(c == canonical(-q));
    CHECK((c == q || c == -q));
    CHECK(*std::find_if(c.begin(), c.end(), [](double x) { return x != 0; }) > 0);
  }
}

TEST_CASE("Conversions keep the meaning of Eigen's quaternion, not the order of its memory", "[quaternion]") {
  const Eigen::Quaterniond eigen(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()));
  const Vector4<double> q = from_eigen(eigen);
  CHECK(q[0] == eigen.w());
  CHECK(max_difference(rotation_matrix(q), eigen.toRotationMatrix()) <= 4 * kEpsilon<double>);
  CHECK(to_eigen(q).coeffs() == eigen.coeffs());
}

TEST_CASE("Invalid rotations are refused with their value", "[quaternion][error]") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  Matrix3<double> reflection = Matrix3<double>::Identity();
  reflection(2, 2) = -1;
  CHECK(error_message([&] { return quaternion_from_rotation_matrix(reflection); }) ==
        "not a rotation matrix: [1, 0, 0; 0, 1, 0; 0, 0, -1]");
  CHECK_THROWS_AS(quaternion_from_rotation_matrix(Matrix3<double>::Zero()), std::invalid_argument);
  CHECK_THROWS_AS(quaternion_from_rotation_matrix(1.0001 * Matrix3<double>::Identity()),
                  std::invalid_argument);
  CHECK_THROWS_AS(quaternion_from_rotation_matrix(Matrix3<double>::Constant(nan)), std::invalid_argument);
  CHECK(error_message([] { return normalized_quaternion(Vector4<double>(2, 0, 0, 0)); }) ==
        "not a unit quaternion (w, x, y, z): [2; 0; 0; 0]");
  CHECK_THROWS_AS(normalized_quaternion(Vector4<double>::Zero()), std::invalid_argument);
  CHECK_THROWS_AS(normalized_quaternion(Vector4<double>::Constant(nan)), std::invalid_argument);
  CHECK(contains(error_message([&] { return quaternion_exp(Vector3<double>(nan, 0, 0)); }), "nan"));
  CHECK(contains(error_message([] { return quaternion_exp(Vector3<double>(0, 1e200, 0)); }),
                 "its square overflows: [0; 1e+200; 0]"));
  CHECK_THROWS_AS(quaternion_exp(Vector3<double>(0, 0, std::numeric_limits<double>::infinity())),
                  std::invalid_argument);
}

TEST_CASE("A rotation matrix printed with six digits is accepted and repaired", "[quaternion]") {
  Rng rng(kSeed);
  CAPTURE(kSeed);
  for (int trial = 0; trial < kTrials; ++trial) {
    const auto q = canonical(random_quaternion<double>(rng));
    const Matrix3<double> rounded = (rotation_matrix(q) * 1e6).array().round() / 1e6;
    const Vector4<double> back = quaternion_from_rotation_matrix(rounded);
    CHECK(std::abs(back.norm() - 1) <= 4 * kEpsilon<double>);
    CHECK(1 - std::abs(back.dot(q)) <= 1e-12);  // entries off by 5e-7, the angle by no more than 2e-6
  }
}

}  // namespace
}  // namespace antipode::test
