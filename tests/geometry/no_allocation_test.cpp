// SPDX-License-Identifier: MIT
#include "support/no_allocation.hpp"

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

  const TestType sum = without_allocation([&] {
    TestType total(0);
    total += compose(a, b, &J).log().sum() + J.sum();
    total += inverse(a, &J).coeffs().sum() + J.sum();
    total += act(a, point, &J_act).sum() + J_act.sum();
    total += exp(xi, &J).coeffs().sum() + J.sum();
    total += log(a, &J).sum() + J.sum();
    total += a.boxplus(xi).boxminus(b).sum() + a.adjoint().sum();
    total += Pose::from_isometry(a.isometry()).renormalized().canonical().coeffs().sum();
    total += Pose::from_coefficients(a.coeffs()).coeffs().sum();
    total += sclerp(a, b, TestType(0.3)).coeffs().sum();
    total += mean(samples).pose.coeffs().sum();
    return total;
  });
  CHECK(std::isfinite(sum));
}

}  // namespace
}  // namespace antipode::test
