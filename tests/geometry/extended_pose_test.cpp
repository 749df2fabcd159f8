// SPDX-License-Identifier: MIT
#include <cmath>
#include <limits>
#include <numbers>

#include <antipode/geometry/chart.hpp>
#include <antipode/geometry/extended_pose.hpp>
#include <antipode/geometry/manifold.hpp>
#include <antipode/testing/check_jacobian.hpp>
#include <antipode/testing/laws.hpp>

#include "support/catch.hpp"
#include "support/error_message.hpp"
#include "support/matrix_exponential.hpp"
#include "support/random.hpp"

namespace antipode::test {
namespace {

template <class Scalar, int K>
struct Group {
  using Element = ExtendedPose<Scalar, K>;
  using Chart = ExtendedPoseChart<Scalar, K>;
  using Tangent = typename Element::Tangent;

  [[nodiscard]] static Tangent tangent(Rng& rng, double angle) {
    Tangent xi = random_matrix<Scalar, Element::kDim, 1>(rng, 3.0);
    xi.template head<3>() = random_twist<Scalar>(rng, angle).template head<3>();
    return xi;
  }
  [[nodiscard]] static Element element(Rng& rng) { return Element::exp(tangent(rng, 2.5)); }
};

/// The element xi^ of the Lie algebra: [[phi]x, nu, rho, ...; 0, 0].
template <class Scalar, int K>
[[nodiscard]] Matrix<Scalar, 3 + K> algebra_of(const Vector<Scalar, 3 + 3 * K>& xi) {
  Matrix<Scalar, 3 + K> A = Matrix<Scalar, 3 + K>::Zero();
  A.template topLeftCorner<3, 3>() = skew(xi.template head<3>());
  for (int k = 0; k < K; ++k) A.template block<3, 1>(0, 3 + k) = xi.template segment<3>(3 + 3 * k);
  return A;
}

/// The matrix ad(xi) with [xi, y] = ad(xi) y, from the commutator of the matrices.
template <int K>
[[nodiscard]] Matrix<double, 3 + 3 * K> commutators_with(const Vector<double, 3 + 3 * K>& xi) {
  using Algebra = Matrix<double, 3 + K>;
  Matrix<double, 3 + 3 * K> ad;
  const Algebra A = algebra_of<double, K>(xi);
  for (int j = 0; j < 3 + 3 * K; ++j) {
    const Algebra B = algebra_of<double, K>(Vector<double, 3 + 3 * K>::Unit(j));
    const Algebra C = A * B - B * A;
    ad.col(j) << C(2, 1), C(0, 2), C(1, 0), C.template topRightCorner<3, K>().reshaped();
  }
  return ad;
}

/// [R, v, p, ...; 0, I].
template <class Scalar, int K>
[[nodiscard]] Matrix<Scalar, 3 + K> matrix_of(const ExtendedPose<Scalar, K>& x) {
  Matrix<Scalar, 3 + K> M = Matrix<Scalar, 3 + K>::Identity();
  M.template topLeftCorner<3, 3>() = x.pose.rotation_matrix();
  M.template topRightCorner<3, K>() = x.columns();
  return M;
}

// Rotations of up to pi in one digit less than the scalar has: coordinates are of the order of ten.
template <class Scalar>
inline constexpr double kGroupTolerance = 500 * kEpsilon<Scalar>;

}  // namespace

TEMPLATE_TEST_CASE("Extended poses obey the laws of a Lie group and of a chart", "[extended_pose][law]",
                   (Group<double, 1>), (Group<double, 2>), (Group<double, 3>), (Group<float, 1>),
                   (Group<float, 2>), (Group<float, 3>)) {
  using Scalar = typename TestType::Element::Scalar;
  STATIC_REQUIRE(LieGroup<typename TestType::Element>);
  for (unsigned seed = 0; seed < 20; ++seed) {
    for (const double angle : {0.0, 1e-8, 0.3, 2.0, 3.1}) {
      CAPTURE(seed, angle);
      Rng rng(seed);
      const auto x = TestType::element(rng), y = TestType::element(rng), z = TestType::element(rng);
      const auto a = TestType::tangent(rng, angle), b = TestType::tangent(rng, 1.0);
      CHECK(testing::check_lie_group_laws(x, y, z, a, kGroupTolerance<Scalar>));
      CHECK(testing::check_chart_laws<typename TestType::Chart>(x, y, a, b, kGroupTolerance<Scalar>));
    }
  }
}

TEMPLATE_TEST_CASE("The product of extended poses is that of their matrices", "[extended_pose]",
                   (Group<double, 1>), (Group<double, 2>), (Group<double, 3>)) {
  Rng rng(3);
  const auto x = TestType::element(rng), y = TestType::element(rng);
  CHECK(max_difference(matrix_of(x * y), matrix_of(x) * matrix_of(y)) <= 1e-13);
  CHECK(max_difference(matrix_of(x.inverse()) * matrix_of(x), matrix_of(TestType::Element::identity())) <=
        1e-13);
}

TEMPLATE_TEST_CASE("Exponentials, adjoints and Jacobians are those of dense matrices", "[extended_pose]",
                   (Group<double, 1>), (Group<double, 2>), (Group<double, 3>), (Group<double, 4>)) {
  using Element = typename TestType::Element;
  constexpr int K = Element::Columns::ColsAtCompileTime, N = Element::kDim;
  for (const double angle :
       {0.0, 1e-8, 0.0999, 0.1001, 1.0, 3.0, std::numbers::pi - 1e-9, std::numbers::pi}) {
    CAPTURE(angle);
    Rng rng(7);
    const auto xi = TestType::tangent(rng, angle);
    const auto ad = commutators_with<K>(xi);
    const auto x = Element::exp(xi);
    CHECK(max_difference(matrix_of(x), matrix_exponential<3 + K>(algebra_of<double, K>(xi))) <= 1e-13);
    CHECK(max_difference(x.adjoint(), matrix_exponential<N>(ad)) <= 1e-12);
    // int_0^1 exp(s ad) ds is the left Jacobian: the upper right block of exp([ad, I; 0, 0]).
    Matrix<double, 2 * N> augmented = Matrix<double, 2 * N>::Zero();
    augmented.template topLeftCorner<N, N>() = ad;
    augmented.template topRightCorner<N, N>().setIdentity();
    const Matrix<double, N> J = matrix_exponential<2 * N>(augmented).template topRightCorner<N, N>();
    CHECK(max_difference(Element::left_jacobian(xi), J) <= 1e-11);  // slopes lose five digits near zero
    CHECK(max_difference(Element::left_jacobian_inverse(xi) * J, Matrix<double, N>::Identity()) <= 1e-11);
    CHECK(max_difference(x.adjoint() * Element::right_jacobian(xi), J) <= 1e-11);
    CHECK(max_difference(Element::right_jacobian_inverse(xi) * Element::right_jacobian(xi),
                         Matrix<double, N>::Identity()) <= 1e-11);
  }
}

TEMPLATE_TEST_CASE("q and -q are the same extended pose", "[extended_pose]", (Group<double, 2>),
                   (Group<double, 3>), (Group<float, 3>)) {
  using Scalar = typename TestType::Element::Scalar;
  using Pose = DualQuaternion<Scalar>;
  const auto zero = TestType::Tangent::Zero();
  constexpr double kPiOf = static_cast<double>(std::numbers::pi_v<Scalar>);
  for (const double angle : {0.0, 1e-8, 1.0, kPiOf - 1e-3, kPiOf}) {
    CAPTURE(angle);
    Rng rng(8);
    const auto xi = TestType::tangent(rng, angle);
    const auto x = TestType::Element::exp(xi);
    auto antipode = x;
    antipode.pose = Pose::unchecked(-x.pose.coeffs());
    CHECK(max_difference(antipode.boxminus(x), zero) <= kGroupTolerance<Scalar>);
    CHECK(max_difference(antipode.adjoint(), x.adjoint()) == 0.0);
    CHECK(max_difference((antipode * x).columns(), (x * x).columns()) <= kGroupTolerance<Scalar>);
    // At half a turn the axis may have either sign; the point is the same.
    CHECK(max_difference(TestType::Element::exp(antipode.log()).boxminus(x), zero) <=
          kGroupTolerance<Scalar>);
    if (angle < 3.0) CHECK(max_difference(antipode.log(), xi) <= kGroupTolerance<Scalar>);
  }
}

TEMPLATE_TEST_CASE("Jacobians of maps between extended poses can be checked", "[extended_pose]",
                   (Group<double, 1>), (Group<double, 2>), (Group<double, 3>)) {
  Rng rng(4);
  const auto x = TestType::element(rng), y = TestType::element(rng);
  CHECK(testing::check_jacobian([&](const auto& z) { return z * y; }, x, y.inverse().adjoint()));
  CHECK(testing::check_jacobian([](const auto& z) { return z.inverse(); }, x, (-x.adjoint()).eval()));
  CHECK_FALSE(testing::check_jacobian([&](const auto& z) { return z * y; }, x, y.adjoint()));
  const auto xi = TestType::tangent(rng, 1.0);
  CHECK(testing::check_jacobian([](const auto& a) { return TestType::Element::exp(a); }, xi,
                                TestType::Chart::jacobian(xi)));
}

TEST_CASE("An extended pose with one vector is a pose", "[extended_pose]") {
  Rng rng(5);
  const auto xi = random_twist<double>(rng, 1.2);
  const auto x = ExtendedPose<double, 1>::exp(xi);
  const auto pose = DualQuaternion<double>::exp(xi);
  CHECK(x.pose.coeffs() == pose.coeffs());
  CHECK(max_difference(x.adjoint(), pose.adjoint()) <= 1e-15);
  CHECK(max_difference(x.log(), pose.log()) <= 1e-15);
  CHECK(x.coeffs() == pose.coeffs());
}

TEST_CASE("The motion by inertial measurements moves errors of any size linearly", "[extended_pose]") {
  // Pose, velocity and gravity g over dt: v + R dv + g dt, p + v dt + R dp + g dt^2/2. The error xi of x
  // exp(xi) becomes Ad(increment^-1) (phi, nu + gamma dt, rho + nu dt + gamma dt^2/2, gamma).
  using Element = ExtendedPose<double, 3>;
  using Pose = DualQuaternion<double>;
  constexpr double kStep_s = 0.4;
  Rng rng(6);
  const Element increment{Pose::exp(random_twist<double>(rng, 0.5)), random_matrix<double, 3, 1>(rng),
                          Vector3<double>::Zero()};
  const auto moved = [&](const Element& x) {
    const Vector3<double> v = x.velocity, g = x.vectors;
    const Vector3<double> p = x.pose.translation() + kStep_s * v + 0.5 * kStep_s * kStep_s * g;
    return Element{Pose::from_rotation_translation(x.pose.rotation(), p), v + kStep_s * g, g} * increment;
  };
  Matrix<double, 12> carry = Matrix<double, 12>::Identity();
  carry.block<3, 3>(3, 9).diagonal().setConstant(kStep_s);
  carry.block<3, 3>(6, 3).diagonal().setConstant(kStep_s);
  carry.block<3, 3>(6, 9).diagonal().setConstant(0.5 * kStep_s * kStep_s);
  const Matrix<double, 12> F = increment.inverse().adjoint() * carry;
  for (int trial = 0; trial < 20; ++trial) {
    const Element x = Group<double, 3>::element(rng);
    const auto xi = Group<double, 3>::tangent(rng, 1.5);
    const Element expected = moved(x).boxplus(F * xi);
    CHECK(moved(x.boxplus(xi)).boxminus(expected).norm() <= 1e-12);
  }
}

TEST_CASE("Extended poses that are not finite are refused with the value", "[extended_pose][error]") {
  ExtendedPose<double, 3> x;
  x.vectors(1, 0) = std::nan("");
  CHECK(contains(error_message([&] { ExtendedPoseChart<double, 3>::require_finite(x); }), "[0; nan; 0]"));
  x = {};
  x.velocity[2] = std::numeric_limits<double>::infinity();
  CHECK(contains(error_message([&] { ExtendedPoseChart<double, 3>::require_finite(x); }), "[0; 0; inf]"));
}

}  // namespace antipode::test
