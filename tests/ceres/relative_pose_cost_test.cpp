// SPDX-License-Identifier: MIT
#include <limits>
#include <stdexcept>
#include <utility>

#include <ceres/autodiff_cost_function.h>

#include <antipode/ceres/relative_pose_cost.hpp>
#include <antipode/testing/check_jacobian.hpp>

#include "support/catch.hpp"
#include "support/error_message.hpp"
#include "support/random.hpp"

namespace antipode::test {
namespace {

constexpr unsigned kEdgeSeed = 11;
using Pose = DualQuaternion<double>;
using Matrix6x8 = Eigen::Matrix<double, 6, 8, Eigen::RowMajor>;
using Matrix8x6 = Eigen::Matrix<double, 8, 6, Eigen::RowMajor>;

/// The same residual, left to automatic differentiation.
struct AutoDiffError {
  Pose T_a_b;
  Matrix6<double> L_inverse;

  template <class T>
  bool operator()(const T* a, const T* b, T* residuals) const {
    const ConstDualQuaternionView<T> T_world_a(a), T_world_b(b);
    const Vector6<T> e = (T_world_a.inverse() * T_world_b).boxminus(T_a_b.cast<T>());
    Eigen::Map<Vector6<T>>{residuals} = L_inverse.cast<T>() * e;
    return true;
  }
};

Matrix6<double> random_covariance(Rng& rng) {
  const Matrix6<double> A = random_matrix<double, 6, 6>(rng);
  return A * A.transpose() + 0.1 * Matrix6<double>::Identity();
}

/// Residual and Jacobians in the tangent spaces of the poses.
struct Evaluated {
  Vector6<double> r;
  Matrix6<double> J_a, J_b;
};

Evaluated evaluate(const ceres::CostFunction& cost, const Pose& a, const Pose& b) {
  const double* blocks[] = {a.coeffs().data(), b.coeffs().data()};
  Matrix6x8 J_a, J_b;
  double* jacobians[] = {J_a.data(), J_b.data()};
  Evaluated result;
  REQUIRE(cost.Evaluate(blocks, result.r.data(), jacobians));
  Matrix8x6 plus_a, plus_b;
  PoseManifold().PlusJacobian(blocks[0], plus_a.data());
  PoseManifold().PlusJacobian(blocks[1], plus_b.data());
  result.J_a = J_a * plus_a;
  result.J_b = J_b * plus_b;
  return result;
}

TEST_CASE("The relative pose's Jacobians are those of automatic differentiation and of differences",
          "[ceres][law]") {
  Rng rng(kEdgeSeed);
  CAPTURE(kEdgeSeed);
  for (const double angle : {0.0, 1e-8, 1e-3, 1.0, 3.0}) {
    for (const double sign : {1.0, -1.0}) {
      CAPTURE(angle, sign);
      const Pose a = random_pose<double>(rng);
      const Pose z = random_pose<double>(rng);
      const Pose b = Pose::unchecked(sign * (a * z.boxplus(random_twist<double>(rng, angle, 1))).coeffs());
      const Matrix6<double> P = random_covariance(rng);
      const RelativePoseCost cost(z, P);
      const ceres::AutoDiffCostFunction<AutoDiffError, 6, 8, 8> automatic(
          new AutoDiffError{z, P.llt().matrixL().solve(Matrix6<double>::Identity())});
      const Evaluated ours = evaluate(cost, a, b);
      const Evaluated theirs = evaluate(automatic, a, b);
      const double scale = 1.0 + theirs.J_a.cwiseAbs().maxCoeff();
      CHECK(max_difference(ours.r, theirs.r) <= 1e-11 * scale);
      CHECK(max_difference(ours.J_a, theirs.J_a) <= 1e-9 * scale);
      CHECK(max_difference(ours.J_b, theirs.J_b) <= 1e-9 * scale);

      const auto residual = [&](const Pose& x, const Pose& y) {
        const double* blocks[] = {x.coeffs().data(), y.coeffs().data()};
        Vector6<double> r;
        REQUIRE(cost.Evaluate(blocks, r.data(), nullptr));
        return r;
      };
      const auto by_a = testing::check_jacobian([&](const Pose& x) { return residual(x, b); }, a, ours.J_a);
      CAPTURE(by_a);
      CHECK(by_a);
      const auto by_b = testing::check_jacobian([&](const Pose& y) { return residual(a, y); }, b, ours.J_b);
      CAPTURE(by_b);
      CHECK(by_b);
    }
  }
}

TEST_CASE("The residual is whitened: its square is the squared Mahalanobis distance", "[ceres]") {
  Rng rng(kEdgeSeed);
  CAPTURE(kEdgeSeed);
  const Pose a = random_pose<double>(rng);
  const Pose z = random_pose<double>(rng);
  const Vector6<double> e = random_twist<double>(rng, 0.7, 1);
  const Matrix6<double> P = random_covariance(rng);
  const auto r = evaluate(RelativePoseCost(z, P), a, a * z.boxplus(e)).r;
  CHECK(r.squaredNorm() == Approx(e.dot(P.inverse() * e)).epsilon(1e-9));
}

TEST_CASE("A pose that is constant gets no Jacobian, and a bad covariance is refused", "[ceres][error]") {
  Rng rng(kEdgeSeed);
  const Pose a = random_pose<double>(rng);
  const Pose b = random_pose<double>(rng);
  const RelativePoseCost cost(a, Matrix6<double>::Identity());
  const double* blocks[] = {a.coeffs().data(), b.coeffs().data()};
  Vector6<double> r;
  Matrix6x8 J_b;
  double* jacobians[] = {nullptr, J_b.data()};
  REQUIRE(cost.Evaluate(blocks, r.data(), jacobians));
  CHECK(J_b.allFinite());
  CHECK_THROWS_AS(RelativePoseCost(a, Matrix6<double>(Matrix6<double>::Zero())), std::invalid_argument);
  CHECK_THROWS_AS(RelativePoseCost(a, Matrix6<double>(-Matrix6<double>::Identity())), std::invalid_argument);
}

TEST_CASE("A relative pose with one triangle of its covariance is refused", "[ceres][error]") {
  for (const auto& [i, j] : {std::pair(0, 4), std::pair(4, 0)}) {
    Matrix6<double> P = Matrix6<double>::Identity();
    P(i, j) = 0.25;
    CHECK(contains(error_message([&] { RelativePoseCost(Pose::identity(), P); }), "not symmetric: [1, 0"));
    P(i, j) = std::numeric_limits<double>::quiet_NaN();
    CHECK_THROWS_AS(RelativePoseCost(Pose::identity(), P), std::invalid_argument);
  }
}

}  // namespace
}  // namespace antipode::test
