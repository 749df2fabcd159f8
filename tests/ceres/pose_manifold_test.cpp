// SPDX-License-Identifier: MIT
#include <ceres/ceres.h>
#include <ceres/manifold_test_utils.h>

#include <antipode/ceres/pose_manifold.hpp>
#include <antipode/testing/check_jacobian.hpp>

#include "support/catch.hpp"
#include "support/random.hpp"

namespace antipode::test {
namespace {

constexpr unsigned kSeed = 7;

/// Whether a matcher of Ceres' manifold_test_utils.h holds, with its explanation.
template <class Matcher>
void check(const ceres::Manifold& manifold, const Matcher& matcher) {
  ::testing::StringMatchResultListener explanation;
  const bool holds = ::testing::ExplainMatchResult(matcher, manifold, &explanation);
  CAPTURE(explanation.str());
  CHECK(holds);
}

TEST_CASE("The pose manifold satisfies every invariant Ceres tests", "[ceres][law]") {
  const PoseManifold manifold;
  REQUIRE(manifold.AmbientSize() == 8);
  REQUIRE(manifold.TangentSize() == 6);
  Rng rng(kSeed);
  CAPTURE(kSeed);
  for (const double angle : {0.0, 1e-8, 1e-3, 1.0, 3.0}) {
    for (int trial = 0; trial < 20; ++trial) {
      const auto pose = random_pose<double>(rng);
      const ceres::Vector x = pose.coeffs();
      const ceres::Vector delta = random_twist<double>(rng, angle, 1);
      // Ceres compares numbers, so y must have the sign that x exp(log(x^-1 y)) has.
      const ceres::Vector y = pose.boxplus(random_twist<double>(rng, 2.0)).coeffs();
      const ceres::Vector zero = ceres::Vector::Zero(6);
      constexpr double kTolerance = 1e-9;  // of Ceres' numeric derivatives; the algebra is far below
      constexpr double kRounding = 1e-13;
      check(manifold, ceres::XPlusZeroIsXAt(x, kRounding));
      check(manifold, ceres::XMinusXIsZeroAt(x, kRounding));
      check(manifold, ceres::MinusPlusIsIdentityAt(x, delta, kRounding));
      check(manifold, ceres::MinusPlusIsIdentityAt(x, zero, kRounding));
      check(manifold, ceres::PlusMinusIsIdentityAt(x, x, kRounding));
      check(manifold, ceres::PlusMinusIsIdentityAt(x, y, kRounding));
      check(manifold, ceres::HasCorrectPlusJacobianAt(x, kTolerance));
      check(manifold, ceres::HasCorrectMinusJacobianAt(x, kTolerance));
      check(manifold, ceres::MinusPlusJacobianIsIdentityAt(x, kRounding));
      check(manifold, ceres::HasCorrectRightMultiplyByPlusJacobianAt(x, kRounding));
    }
  }
}

TEST_CASE("Plus and its Jacobian are those of the toolkit", "[ceres]") {
  const PoseManifold manifold;
  Rng rng(kSeed);
  CAPTURE(kSeed);
  const auto x = random_pose<double>(rng);
  const Vector6<double> xi = random_twist<double>(rng, 1.0);
  Vector8<double> moved;
  REQUIRE(manifold.Plus(x.coeffs().data(), xi.data(), moved.data()));
  CHECK(DualQuaternion<double>::unchecked(moved).is_approx(x.boxplus(xi), 1e-15));

  Eigen::Matrix<double, 8, 6, Eigen::RowMajor> J;
  REQUIRE(manifold.PlusJacobian(x.coeffs().data(), J.data()));
  const auto plus = [&](const Vector6<double>& d) { return Vector8<double>(x.boxplus(d).coeffs()); };
  const auto result = testing::check_jacobian(plus, Vector6<double>(Vector6<double>::Zero()), J);
  CAPTURE(result);
  CHECK(result);
}

TEST_CASE("A step that is not finite is refused", "[ceres][error]") {
  const PoseManifold manifold;
  const Vector8<double> x = Vector8<double>::Unit(0);
  Vector8<double> moved;
  Vector6<double> xi = Vector6<double>::Zero();
  xi[4] = std::nan("");
  CHECK_FALSE(manifold.Plus(x.data(), xi.data(), moved.data()));
  xi[4] = 0;
  CHECK_FALSE(manifold.Plus(Vector8<double>::Constant(std::nan("")).eval().data(), xi.data(), moved.data()));
  CHECK_FALSE(manifold.Plus(Vector8<double>::Zero().eval().data(), xi.data(), moved.data()));
}

/// log(z^-1 x_a^-1 x_b) for the measured relative pose z, differentiated automatically.
struct RelativePoseError {
  DualQuaternion<double> T_a_b_measured;

  template <class T>
  bool operator()(const T* a, const T* b, T* residuals) const {
    const ConstDualQuaternionView<T> T_world_a(a), T_world_b(b);
    Eigen::Map<Vector6<T>>{residuals} = (T_world_a.inverse() * T_world_b).boxminus(T_a_b_measured.cast<T>());
    return true;
  }
};

TEST_CASE("Ceres closes a loop of poses through views, and its covariance is that of the right perturbation",
          "[ceres]") {
  using Pose = DualQuaternion<double>;
  Rng rng(kSeed);
  CAPTURE(kSeed);
  constexpr int kPoses = 12;
  std::vector<Pose> truth, estimate;
  for (int k = 0; k < kPoses; ++k) {
    truth.push_back(k == 0 ? Pose() : truth.back() * Pose::exp(random_twist<double>(rng, 0.6, 1)));
    estimate.push_back(k == 0 ? Pose() : truth.back().boxplus(0.3 * random_matrix<double, 6, 1>(rng)));
  }
  std::vector<Vector8<double>> parameters;
  parameters.reserve(kPoses);
  for (int k = 0; k < kPoses; ++k)
    parameters.push_back((k % 2 == 0 ? 1 : -1) * estimate[std::size_t(k)].coeffs());

  ceres::Problem problem;
  for (auto& block : parameters) problem.AddParameterBlock(block.data(), 8, new PoseManifold);
  problem.SetParameterBlockConstant(parameters[0].data());
  for (std::size_t k = 0; k < kPoses; ++k) {
    const std::size_t next = (k + 1) % kPoses;
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<RelativePoseError, 6, 8, 8>(
                                 new RelativePoseError{truth[k].inverse() * truth[next]}),
                             nullptr, parameters[k].data(), parameters[next].data());
  }
  ceres::Solver::Options options;
  options.function_tolerance = 1e-20;
  options.gradient_tolerance = 1e-14;
  options.parameter_tolerance = 1e-14;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  CAPTURE(summary.BriefReport());
  for (std::size_t k = 0; k < kPoses; ++k) {
    CHECK(Pose::from_coefficients(parameters[k]).is_approx(truth[k], 1e-8));
  }

  // With unit information on every edge, the first free pose is seen over the edge to the fixed one and over
  // the rest of the loop: its information is I + (sum over the rest of Ad-transported I)^-1, in the tangent
  // space on the right.
  ceres::Covariance covariance({});
  double* first = parameters[1].data();
  REQUIRE(covariance.Compute(std::vector<const double*>{first}, &problem));
  Eigen::Matrix<double, 6, 6, Eigen::RowMajor> P;
  REQUIRE(covariance.GetCovarianceBlockInTangentSpace(first, first, P.data()));
  Matrix6<double> rest = Matrix6<double>::Zero();
  for (std::size_t k = 2; k <= kPoses; ++k) {
    const Matrix6<double> Ad = (truth[1].inverse() * truth[k % kPoses]).adjoint();
    rest += Ad * Ad.transpose();
  }
  const Matrix6<double> expected = (Matrix6<double>::Identity() + rest.inverse()).inverse();
  CHECK(max_difference(P, expected) <= 1e-6);
}

}  // namespace
}  // namespace antipode::test
