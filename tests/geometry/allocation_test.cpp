// SPDX-License-Identifier: MIT
#undef NDEBUG  // Eigen reports a forbidden allocation by an assertion
#define EIGEN_RUNTIME_NO_MALLOC
#include <cmath>

#include <antipode/geometry/dual_quaternion.hpp>
#include <antipode/geometry/interpolation.hpp>

#include "support/catch.hpp"
#include "support/random.hpp"

namespace antipode::test {
namespace {

TEMPLATE_TEST_CASE("No operation on poses allocates", "[dual_quaternion][allocation]", float, double) {
  using Pose = DualQuaternion<TestType>;
  Rng rng(5);
  const Pose a = random_pose<TestType>(rng), b = random_pose<TestType>(rng);
  const Vector6<TestType> xi = random_twist<TestType>(rng, 1.0);
  const Vector3<TestType> point = random_matrix<TestType, 3, 1>(rng);
  Matrix6<TestType> J;
  Matrix<TestType, 3, 6> J_act;
  WeightedSamples<TestType, 8, 3> samples;
  samples.points << a.coeffs(), a.boxplus(TestType(0.1) * xi).coeffs(),
      a.boxplus(TestType(-0.2) * xi).coeffs();
  samples.weights.setConstant(TestType(1) / TestType(3));

  Eigen::internal::set_is_malloc_allowed(false);
  TestType sum(0);
  sum += compose(a, b, &J).log().sum() + J.sum();
  sum += inverse(a, &J).coeffs().sum() + J.sum();
  sum += act(a, point, &J_act).sum() + J_act.sum();
  sum += exp(xi, &J).coeffs().sum() + J.sum();
  sum += log(a, &J).sum() + J.sum();
  sum += a.boxplus(xi).boxminus(b).sum() + a.adjoint().sum();
  sum += Pose::from_isometry(a.isometry()).renormalized().canonical().coeffs().sum();
  sum += Pose::from_coefficients(a.coeffs()).coeffs().sum();
  sum += sclerp(a, b, TestType(0.3)).coeffs().sum();
  sum += mean(samples).pose.coeffs().sum();
  Eigen::internal::set_is_malloc_allowed(true);

  CHECK(std::isfinite(sum));
}

}  // namespace
}  // namespace antipode::test
