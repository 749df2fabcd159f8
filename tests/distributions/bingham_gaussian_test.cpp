// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include <antipode/detail/products.hpp>
#include <antipode/distributions/bingham_gaussian.hpp>

#include "distributions/random_densities.hpp"
#include "distributions/sphere_quadrature.hpp"
#include "support/catch.hpp"
#include "support/error_message.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

/// P = A A^T with a rotation part of standard deviation `angle` and a translation part of order one.
template <class Scalar>
Matrix6<Scalar> random_pose_covariance(Rng& rng, double angle) {
  Matrix6<Scalar> A = random_matrix<Scalar, 6>(rng);
  A.template topRows<3>() *= static_cast<Scalar>(angle);
  return detail::scaled_square<Scalar, 6, 6>(A, Vector6<Scalar>::Ones());
}

/// a b^T.
Matrix3<double> outer(const Vector3<double>& a, const Vector3<double>& b) { return a * b.transpose(); }

/// Largest entry of |A - B| relative to the standard deviations in A.
template <class Scalar>
double relative_covariance_difference(const Matrix6<Scalar>& A, const Matrix6<Scalar>& B) {
  Matrix6<Scalar> difference = B - A;
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) difference(i, j) /= std::sqrt(A(i, i) * A(j, j));
  }
  return max_difference(difference, Matrix6<Scalar>::Zero());
}

}  // namespace

TEMPLATE_TEST_CASE("The pose density is the Bingham density times the conditional Gaussian", "[pose]", float,
                   double) {
  for (unsigned seed = 0; seed < 30; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto x = random_bingham_gaussian<TestType>(rng, -1.0, 1.5);
    const auto pose = random_pose<TestType>(rng);
    const Gaussian<TestType, 3> conditional(x.conditional_mean(pose.rotation()), x.conditional_covariance());
    const TestType expected =
        x.orientation().log_density(pose.rotation()) + conditional.log_density(pose.translation());
    CHECK(static_cast<double>(std::abs(x.log_density(pose) - expected)) <=
          100 * kEpsilon<TestType> * (1.0 + static_cast<double>(std::abs(expected))));
  }
}

TEMPLATE_TEST_CASE("A pose and its antipode have the same density, bit for bit", "[pose][law]", float,
                   double) {
  for (unsigned seed = 0; seed < 100; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto x = random_bingham_gaussian<TestType>(rng, -2.0, 6.0);
    const auto pose = random_pose<TestType>(rng);
    const auto antipode = DualQuaternion<TestType>::unchecked(-pose.coeffs());
    CHECK(x.log_density(antipode) == x.log_density(pose));
    CHECK(x.orientation_offset(-pose.rotation()) == x.orientation_offset(pose.rotation()));
  }
}

TEMPLATE_TEST_CASE("Flipping an axis with its column of the coupling changes nothing", "[pose][law]", float,
                   double) {
  for (unsigned seed = 0; seed < 30; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto x = random_bingham_gaussian<TestType>(rng, -2.0, 4.0);
    Matrix4<TestType> axes = x.orientation().axes();
    Matrix3<TestType> coupling = x.coupling();
    axes.col(1) *= TestType(-1);
    coupling.col(1) *= TestType(-1);
    axes.col(3) *= TestType(-1);
    coupling *= TestType(-1);
    const BinghamGaussian<TestType> y(
        Bingham<TestType, 4>::from_parameters(axes, x.orientation().concentrations()), x.mean_translation(),
        coupling, x.conditional_covariance());
    const Vector4<TestType> q = random_quaternion<TestType>(rng);
    CHECK(max_difference(x.conditional_mean(q), y.conditional_mean(q)) <= 20 * kEpsilon<TestType>);
    CHECK(relative_covariance_difference(x.covariance(), y.covariance()) <= 40 * kEpsilon<TestType>);
  }
}

TEST_CASE("Draws have the translation's mean, covariance and correlation with the orientation", "[pose]") {
  // E over the sphere by quadrature, over t | q in closed form.
  Rng rng(1);
  const auto x = random_bingham_gaussian<double>(rng, -1.0, 1.3);
  const auto moments = [&](const Vector4<double>& q) -> Matrix<double, 3, 10> {
    const Vector3<double> tau = x.orientation_offset(q);
    const Vector3<double> d = x.conditional_mean(q) - x.mean_translation();
    Matrix<double, 3, 10> m;
    m << d, outer(d, d) + x.conditional_covariance(), outer(d, tau), outer(tau, tau);
    return std::exp(x.orientation().log_density(q)) * m;
  };
  const auto m = integrate_over_s3(moments, Matrix<double, 3, 10>::Zero().eval());
  const Matrix3<double> T = x.orientation_offset_variances().asDiagonal();
  CHECK(max_difference(m.col(0), Vector3<double>::Zero()) <= 1e-11);
  CHECK(max_difference(m.middleCols<3>(1), x.translation_covariance()) <= 1e-11);
  CHECK(max_difference(m.middleCols<3>(4), x.coupling() * T) <= 1e-11);
  CHECK(max_difference(m.middleCols<3>(7), T) <= 1e-11);
}

TEMPLATE_TEST_CASE("Draws have the moments of the density", "[pose][random]", float, double) {
  Rng rng(3);
  const auto x = random_bingham_gaussian<TestType>(rng, -1.0, 2.0);
  constexpr int kDraws = 40000;
  Vector6<double> sum = Vector6<double>::Zero();
  Matrix6<double> squares = Matrix6<double>::Zero();
  for (int k = 0; k < kDraws; ++k) {
    const auto pose = x.sample(rng);
    const Vector3<TestType> tau = x.orientation_offset(pose.rotation());
    const Vector3<TestType> t = pose.translation() - x.mean_translation();
    Vector6<double> y;
    for (int i = 0; i < 3; ++i) {
      y[i] = static_cast<double>(tau[i]);
      y[i + 3] = static_cast<double>(t[i]);
    }
    sum += y;
    detail::add_outer_product(1.0 / kDraws, y, y, squares);
  }
  // (tau, t) = (I; G) tau + (0; residual).
  const Matrix3<TestType>& G = x.coupling();
  const Vector3<TestType> T = x.orientation_offset_variances();
  Matrix6<double> expected = Matrix6<double>::Zero();
  for (int i = 0; i < 3; ++i) {
    expected(i, i) = static_cast<double>(T[i]);
    for (int j = 0; j < 3; ++j) {
      expected(i + 3, j) = expected(j, i + 3) = static_cast<double>(G(i, j) * T[j]);
      expected(i + 3, j + 3) = static_cast<double>(x.translation_covariance()(i, j));
    }
  }
  // Five standard errors; products of two components have at most three times the Gaussian spread.
  for (int i = 0; i < 6; ++i) {
    CHECK(std::abs(sum[i]) / kDraws <= 5.0 * std::sqrt(expected(i, i) / kDraws));
  }
  CHECK(relative_covariance_difference(expected, squares) <= 5.0 * std::sqrt(3.0 / kDraws));
}

TEMPLATE_TEST_CASE("Conversion of a pose covariance and back is exact", "[pose][law]", float, double) {
  for (unsigned seed = 0; seed < 60; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto pose = random_pose<TestType>(rng);
    const Matrix6<TestType> P = random_pose_covariance<TestType>(rng, seed % 2 ? 0.2 : 0.01);
    const auto x = BinghamGaussian<TestType>::from_pose_covariance(pose, P);
    CHECK(x.pose().is_approx(pose, static_cast<TestType>(20 * kEpsilon<TestType>)));
    // The smallest eigenvalue of the rotation part carries the relative error epsilon/omega.
    CHECK(relative_covariance_difference(P, x.covariance()) <= 2e3 * kEpsilon<TestType>);
  }
}

TEST_CASE("The covariance is that of the right perturbation", "[pose][random]") {
  Rng rng(4);
  const auto pose = random_pose<double>(rng);
  const Matrix6<double> P = random_pose_covariance<double>(rng, 0.02);
  const auto x = BinghamGaussian<double>::from_pose_covariance(pose, P);
  constexpr int kDraws = 40000;
  Matrix6<double> squares = Matrix6<double>::Zero();
  for (int k = 0; k < kDraws; ++k) {
    const Vector6<double> xi = x.sample(rng).boxminus(pose);
    detail::add_outer_product(1.0 / kDraws, xi, xi, squares);
  }
  // Five standard errors of a Gaussian, and the second order of rotations of 0.02 rad.
  CHECK(relative_covariance_difference(P, squares) <= 5.0 * std::sqrt(2.0 / kDraws) + 0.01);
}

TEMPLATE_TEST_CASE("Degenerate pose covariances give densities", "[pose]", float, double) {
  using Density = BinghamGaussian<TestType>;
  Rng rng(5);
  const auto pose = random_pose<TestType>(rng);
  const auto certain = Density::from_pose_covariance(pose, Matrix6<TestType>::Zero());
  CHECK(certain.pose().is_approx(pose, static_cast<TestType>(10 * kEpsilon<TestType>)));
  CHECK(max_difference(certain.covariance(), Matrix6<TestType>::Zero()) <=
        4.1 * std::max(5e-9, kEpsilon<TestType>));

  // A lever: the translation is a function of the rotation, nothing is left over.
  Matrix<TestType, 6, 3> lever;
  lever << Matrix3<TestType>::Identity() * TestType(0.1), random_matrix<TestType, 3>(rng, 2.0);
  const Matrix6<TestType> P = detail::scaled_square<TestType, 6, 3>(lever, Vector3<TestType>::Ones());
  const auto rigid = Density::from_pose_covariance(pose, P);
  CHECK(relative_covariance_difference(P, rigid.covariance()) <= 100 * kEpsilon<TestType>);
  CHECK(max_difference(rigid.conditional_covariance(), Matrix3<TestType>::Zero()) <=
        100 * kEpsilon<TestType>);
}

TEMPLATE_TEST_CASE("A change of the parent frame moves the density exactly", "[pose][law]", float, double) {
  for (unsigned seed = 0; seed < 30; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const auto x = random_bingham_gaussian<TestType>(rng, -1.0, 2.0);
    const auto y = random_pose<TestType>(rng), pose = random_pose<TestType>(rng);
    const auto moved = compose(y, x);
    const double expected = static_cast<double>(x.log_density(pose));
    CHECK(std::abs(static_cast<double>(moved.log_density(y * pose)) - expected) <=
          2e3 * kEpsilon<TestType> * (1.0 + std::abs(expected)));
    CHECK(moved.pose().is_approx(y * x.pose(), static_cast<TestType>(20 * kEpsilon<TestType>)));
    CHECK(relative_covariance_difference(moved.covariance(), x.covariance()) <= 100 * kEpsilon<TestType>);
  }
}

TEST_CASE("A change of the child frame keeps all moments", "[pose][law]") {
  Rng rng(6);
  const auto x = random_bingham_gaussian<double>(rng, -1.0, 1.3);
  const auto y = random_pose<double>(rng);
  const auto moved = compose(x, y);
  const auto moments = [&](const Vector4<double>& q) -> Matrix<double, 3, 10> {
    const Vector3<double> t = x.conditional_mean(q) + rotate(q, y.translation());
    const Vector3<double> tau = moved.orientation_offset(hamilton_product(q, y.rotation()));
    const Vector3<double> d = t - moved.mean_translation();
    Matrix<double, 3, 10> m;
    m << d, outer(d, d) + x.conditional_covariance(), outer(d, tau), outer(tau, tau);
    return std::exp(x.orientation().log_density(q)) * m;
  };
  const auto m = integrate_over_s3(moments, Matrix<double, 3, 10>::Zero().eval());
  const Matrix3<double> T = moved.orientation_offset_variances().asDiagonal();
  CHECK(max_difference(m.col(0), Vector3<double>::Zero()) <= 1e-10);
  CHECK(max_difference(m.middleCols<3>(1), moved.translation_covariance()) <= 1e-10);
  CHECK(max_difference(m.middleCols<3>(4), moved.coupling() * T) <= 1e-10);
  CHECK(max_difference(m.middleCols<3>(7), T) <= 1e-10);
  const Vector4<double> q = random_quaternion<double>(rng);
  CHECK(std::abs(moved.orientation().log_density(hamilton_product(q, y.rotation())) -
                 x.orientation().log_density(q)) <= 1e-12);
}

TEMPLATE_TEST_CASE("A concentrated density changes the child frame by the adjoint", "[pose][law]", float,
                   double) {
  Rng rng(7);
  for (int trial = 0; trial < 20; ++trial) {
    const auto x = BinghamGaussian<TestType>::from_pose_covariance(
        random_pose<TestType>(rng), random_pose_covariance<TestType>(rng, 0.01));
    const auto y = random_pose<TestType>(rng);
    const auto moved = compose(x, y);
    const Matrix6<TestType> expected =
        detail::congruence<TestType, 6, 6>(y.inverse().adjoint(), x.covariance());
    // Of second order in the rotation: omega is at most 1e-4, with the lever |t_y|^2 up to 30.
    CHECK(relative_covariance_difference(expected, moved.covariance()) <= 0.01);
    CHECK(moved.pose().is_approx(x.pose() * y, TestType(1e-3)));
  }
}

TEMPLATE_TEST_CASE("The identity changes no frame", "[pose][law]", float, double) {
  Rng rng(8);
  const auto x = random_bingham_gaussian<TestType>(rng, -1.0, 2.0);
  const auto identity = DualQuaternion<TestType>::identity();
  for (const auto& same : {compose(identity, x), compose(x, identity)}) {
    CHECK(relative_covariance_difference(same.covariance(), x.covariance()) <= 20 * kEpsilon<TestType>);
    CHECK(max_difference(same.mean_translation(), x.mean_translation()) <= 10 * kEpsilon<TestType>);
  }
}

TEMPLATE_TEST_CASE("Invalid arguments of a pose density are refused", "[pose][error]", float, double) {
  using Density = BinghamGaussian<TestType>;
  constexpr TestType kNan = std::numeric_limits<TestType>::quiet_NaN();
  const auto orientation = Bingham<TestType, 4>::uniform();
  const Vector3<TestType> zero = Vector3<TestType>::Zero();
  const Matrix3<TestType> I = Matrix3<TestType>::Identity();
  const Matrix3<TestType> bad = I * kNan;
  CHECK(contains(error_message([&] { return Density(orientation, zero * kNan, I, I); }), "mean translation"));
  CHECK(contains(error_message([&] { return Density(orientation, zero, bad, I); }), "coupling"));
  CHECK(contains(error_message([&] { return Density(orientation, zero, I, bad); }), "covariance"));
  CHECK(contains(error_message([&] { return Density(orientation, zero, I, -I); }), "negative eigenvalue"));

  const auto from = [](const Matrix6<TestType>& P) {
    return error_message(
        [&] { return Density::from_pose_covariance(DualQuaternion<TestType>::identity(), P); });
  };
  Matrix6<TestType> P = Matrix6<TestType>::Identity() * TestType(0.01);
  CHECK(from(P) == "nothing thrown");
  P(0, 5) = TestType(0.001);
  CHECK(contains(from(P), "not symmetric"));
  P(5, 0) = P(0, 5) = TestType(0.02);
  CHECK(contains(from(P), "negative eigenvalue"));
  P(5, 0) = P(0, 5) = kNan;
  CHECK(contains(from(P), "not finite"));
  CHECK(contains(from(Matrix6<TestType>::Identity() * TestType(2)), "too wide"));
}

TEST_CASE("A density without spread about its conditional mean has samples but no density values",
          "[pose][error]") {
  const auto x = BinghamGaussian<double>::independent(Bingham<double, 4>::uniform(), Vector3<double>(1, 2, 3),
                                                      Matrix3<double>::Zero());
  Rng rng(9);
  CHECK(max_difference(x.sample(rng).translation(), Vector3<double>(1, 2, 3)) <= 1e-15);
  CHECK_THROWS_AS(x.log_density(DualQuaternion<double>::identity()), std::domain_error);
}
