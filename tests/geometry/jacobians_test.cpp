// SPDX-License-Identifier: MIT
#include <numbers>
#include <vector>

#include <ceres/jet.h>

#include <antipode/geometry/dual_quaternion.hpp>
#include <antipode/geometry/interpolation.hpp>
#include <antipode/testing/check_jacobian.hpp>

#include "support/catch.hpp"
#include "support/random.hpp"

namespace antipode::test {
namespace {

using antipode::testing::check_jacobian;

constexpr unsigned kSeed = 3;

/// Twists where something could go wrong: identity, 1e-8, both sides of the change of formula, random, near
/// pi (by more than the difference step, which must not cross it).
template <class Scalar>
std::vector<Vector6<Scalar>> hard_twists(Rng& rng) {
  std::vector<Vector6<Scalar>> twists = {Vector6<Scalar>::Zero()};
  for (const double angle : {0.0, 1e-8, 1e-4, 0.0999, 0.1001, 0.7, 2.0, 3.0, std::numbers::pi - 0.03}) {
    for (int trial = 0; trial < 10; ++trial) {
      twists.push_back(random_twist<Scalar>(rng, angle, 2));
    }
  }
  return twists;
}

TEMPLATE_TEST_CASE("Jacobians of compose, inverse and act agree with central differences", "[jacobian]",
                   float, double) {
  using Pose = DualQuaternion<TestType>;
  using Point = Vector3<TestType>;
  Rng rng(kSeed);
  CAPTURE(kSeed);
  for (const Vector6<TestType>& xi : hard_twists<TestType>(rng)) {
    const Pose a = Pose::exp(xi), b = random_pose<TestType>(rng);
    const Point point = random_matrix<TestType, 3, 1>(rng, 2);
    Matrix6<TestType> J_a, J_b, J;
    Matrix<TestType, 3, 6> J_act;
    Matrix3<TestType> J_point;
    CHECK(compose(a, b, &J_a, &J_b).coeffs() == (a * b).coeffs());
    CHECK(inverse(a, &J).coeffs() == a.inverse().coeffs());
    CHECK(act(a, point, &J_act, &J_point) == a * point);
    CAPTURE(xi.transpose());
    const auto in_a = check_jacobian([&](const Pose& x) { return x * b; }, a, J_a);
    const auto in_b = check_jacobian([&](const Pose& x) { return a * x; }, b, J_b);
    const auto of_inverse = check_jacobian([](const Pose& x) { return x.inverse(); }, a, J);
    const auto of_act = check_jacobian([&](const Pose& x) { return Point(x * point); }, a, J_act);
    const auto in_point = check_jacobian([&](const Point& v) { return Point(a * v); }, point, J_point);
    CAPTURE(in_a, in_b, of_inverse, of_act, in_point);
    CHECK((in_a && in_b && of_inverse && of_act && in_point));
  }
}

TEMPLATE_TEST_CASE("Jacobians of exp and log agree with central differences", "[jacobian]", float, double) {
  using Pose = DualQuaternion<TestType>;
  Rng rng(kSeed);
  CAPTURE(kSeed);
  for (const Vector6<TestType>& xi : hard_twists<TestType>(rng)) {
    Matrix6<TestType> J_exp, J_log;
    const Pose x = exp(xi, &J_exp);
    CHECK(max_difference(log(x, &J_log), xi) <= 100 * kEpsilon<TestType>);
    const auto of_exp = check_jacobian([](const Vector6<TestType>& v) { return Pose::exp(v); }, xi, J_exp);
    const auto of_log = check_jacobian([](const Pose& y) { return y.log(); }, x, J_log);
    CAPTURE(xi.transpose(), of_exp, of_log);
    CHECK((of_exp && of_log));
  }
}

TEMPLATE_TEST_CASE("Left and right Jacobians are inverse to their inverses and related by the adjoint",
                   "[jacobian][law]", float, double) {
  Rng rng(kSeed);
  CAPTURE(kSeed);
  // At an angle of 0.1 the closed forms lose a factor 1/0.1^2 of the precision, times sums of twenty terms.
  const double tolerance = 200 * kEpsilon<TestType>;
  for (const Vector6<TestType>& xi : hard_twists<TestType>(rng)) {
    const Vector3<TestType> phi = xi.template head<3>();
    CAPTURE(xi.transpose());
    CHECK(max_difference(so3_left_jacobian(phi) * so3_left_jacobian_inverse(phi),
                         Matrix3<TestType>::Identity()) <= tolerance);
    CHECK(max_difference(so3_right_jacobian(phi) * so3_right_jacobian_inverse(phi),
                         Matrix3<TestType>::Identity()) <= tolerance);
    CHECK(max_difference(so3_left_jacobian(phi),
                         rotation_matrix(quaternion_exp(phi)) * so3_right_jacobian(phi)) <= tolerance);
    CHECK(max_difference(se3_left_jacobian(xi) * se3_left_jacobian_inverse(xi),
                         Matrix6<TestType>::Identity()) <= tolerance);
    CHECK(max_difference(se3_right_jacobian(xi) * se3_right_jacobian_inverse(xi),
                         Matrix6<TestType>::Identity()) <= tolerance);
    CHECK(max_difference(se3_left_jacobian(xi),
                         DualQuaternion<TestType>::exp(xi).adjoint() * se3_right_jacobian(xi)) <= tolerance);
    CHECK(max_difference(se3_left_jacobian(xi).template topLeftCorner<3, 3>(), so3_left_jacobian(phi)) <=
          tolerance);
  }
}

TEST_CASE("The left Jacobian is continuous where the series meets the closed form", "[jacobian]") {
  Rng rng(kSeed);
  CAPTURE(kSeed);
  for (int trial = 0; trial < 100; ++trial) {
    const Vector6<double> direction = random_twist<double>(rng, 1, 2);
    Vector6<double> below = direction, above = direction;
    below.head<3>() *= 0.1 * (1 - 1e-15);
    above.head<3>() *= 0.1 * (1 + 1e-15);
    CHECK(max_difference(se3_left_jacobian(below), se3_left_jacobian(above)) <= 1e-14);
    CHECK(max_difference(se3_left_jacobian_inverse(below), se3_left_jacobian_inverse(above)) <= 1e-13);
  }
}

// Automatic differentiation has no step to choose: it must agree to rounding, at the identity as well.
TEST_CASE("Dual numbers differentiate exp, log, products and points to rounding", "[jacobian][jet]") {
  using Jet = ceres::Jet<double, 6>;
  using JetPose = DualQuaternion<Jet>;
  Rng rng(kSeed);
  CAPTURE(kSeed);
  Vector6<Jet> d;
  for (int i = 0; i < 6; ++i) d[i] = Jet(0.0, i);
  const auto derivative = [](const auto& values) {
    Matrix<double, std::decay_t<decltype(values)>::RowsAtCompileTime, 6> J;
    for (int i = 0; i < J.rows(); ++i) J.row(i) = values[i].v.transpose();
    return J;
  };
  for (const Vector6<double>& xi : hard_twists<double>(rng)) {
    Matrix6<double> J_exp, J_log, J_inverse;
    Matrix<double, 3, 6> J_act;
    const auto x = exp(xi, &J_exp);
    (void)log(x, &J_log);
    (void)inverse(x, &J_inverse);
    const Vector3<double> point = random_matrix<double, 3, 1>(rng);
    (void)act(x, point, &J_act);
    const JetPose moving = x.cast<Jet>().boxplus(d);
    CAPTURE(xi.transpose());
    const double tolerance = 1e-12;
    CHECK(max_difference(derivative(moving.log()), J_log) <= tolerance);
    CHECK(max_difference(derivative(moving * point.cast<Jet>()), J_act) <= tolerance);
    CHECK(max_difference(derivative(moving.inverse().boxminus(x.inverse().cast<Jet>())), J_inverse) <=
          tolerance);
    CHECK(max_difference(derivative(JetPose::exp(xi.cast<Jet>() + d).boxminus(x.cast<Jet>())), J_exp) <=
          tolerance);
    CHECK(JetPose::from_coefficients(moving.coeffs()).is_approx(moving, Jet(tolerance)));
    CHECK(JetPose::from_isometry(moving.isometry()).is_approx(moving, Jet(tolerance)));
    CHECK(sclerp(JetPose(), moving, Jet(1.0)).is_approx(moving, Jet(tolerance)));
  }
}

TEST_CASE("A wrong Jacobian fails the check, and the report shows both matrices", "[jacobian][testing]") {
  const Vector3<double> x(1, 2, 3);
  const auto square = [](const Vector3<double>& v) { return Vector3<double>(v.cwiseProduct(v)); };
  const Matrix3<double> right = Vector3<double>(2 * x).asDiagonal();
  Matrix3<double> wrong = right;
  wrong(2, 1) = 1e-6;
  CHECK(check_jacobian(square, x, right));
  const auto check = check_jacobian(square, x, wrong);
  CHECK_FALSE(check);
  CHECK(check.largest_error == Approx(1e-6).epsilon(1e-3));
  CHECK(check.report.find("analytic:\n") != std::string::npos);
  CHECK(check.report.find("central differences:\n") != std::string::npos);
  wrong(2, 1) = std::numeric_limits<double>::quiet_NaN();
  CHECK_FALSE(check_jacobian(square, x, wrong));
}

}  // namespace
}  // namespace antipode::test
