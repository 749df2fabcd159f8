// SPDX-License-Identifier: MIT
#include <limits>
#include <numbers>

#include <antipode/geometry/interpolation.hpp>

#include "geometry/antipode_of.hpp"
#include "support/catch.hpp"
#include "support/error_message.hpp"
#include "support/random.hpp"

namespace antipode::test {
namespace {

constexpr unsigned kScrewSeed = 4;
constexpr int kScrewTrials = 100;

TEMPLATE_TEST_CASE("ScLERP meets both ends, moves at constant velocity and is independent of signs",
                   "[interpolation][law]", float, double) {
  using Pose = DualQuaternion<TestType>;
  Rng rng(kScrewSeed);
  CAPTURE(kScrewSeed);
  const auto tolerance = static_cast<TestType>(200 * kEpsilon<TestType>);
  for (int trial = 0; trial < kScrewTrials; ++trial) {
    const Pose a = random_pose<TestType>(rng), b = random_pose<TestType>(rng);
    const TestType tau = uniform<TestType>(rng, 0, 1);
    CHECK(sclerp(a, b, TestType(0)).coeffs() == a.coeffs());
    CHECK(sclerp(a, b, TestType(1)).is_approx(b, tolerance));
    CHECK(sclerp(a, b, tau).is_approx(sclerp(b, a, 1 - tau), tolerance));
    CHECK(sclerp(a, b, tau).is_approx(sclerp(antipode_of(a), b, tau), tolerance));
    CHECK(sclerp(a, b, tau).is_approx(sclerp(a, antipode_of(b), tau), tolerance));
    CHECK(max_difference(sclerp(a, b, tau).boxminus(a), tau * b.boxminus(a)) <= 200 * kEpsilon<TestType>);
    const Pose frame = random_pose<TestType>(rng);
    CHECK((frame * sclerp(a, b, tau)).is_approx(sclerp(frame * a, frame * b, tau), tolerance));
    CHECK((sclerp(a, b, tau) * frame).is_approx(sclerp(a * frame, b * frame, tau), tolerance));
  }
}

TEST_CASE("ScLERP extrapolates beyond its ends, and refuses a tau that is not finite", "[interpolation]") {
  Rng rng(kScrewSeed);
  const auto a = random_pose<double>(rng), b = random_pose<double>(rng);
  CHECK(sclerp(a, sclerp(a, b, 0.25), 4.0).is_approx(b, 1e-13));
  CHECK_THROWS_AS(sclerp(a, b, std::numeric_limits<double>::quiet_NaN()), std::invalid_argument);
}

TEST_CASE("ScLERP over half a turn follows one of the two screws", "[interpolation]") {
  using Pose = DualQuaternion<double>;
  const Pose b = Pose::from_rotation_translation(Vector4<double>(0, 0, 0, 1), Vector3<double>(1, 2, 3));
  const Pose middle = sclerp(Pose(), b, 0.5);
  CHECK(quaternion_log(middle.real()).norm() == Approx(std::numbers::pi / 2));
  CHECK((middle * middle).is_approx(b, 1e-15));
}

/// Poses within `spread` of a common one, of random signs, and weights that do not sum to one.
struct Cloud {
  Matrix<double, 8, 9> poses;
  Vector<double, 9> weights;
};

Cloud random_cloud(Rng& rng, const DualQuaternion<double>& center, double spread) {
  Cloud cloud;
  for (int k = 0; k < 9; ++k) {
    const auto x = center.boxplus(spread * random_matrix<double, 6, 1>(rng));
    cloud.poses.col(k) = (k % 2 == 0 ? 1.0 : -1.0) * x.coeffs();
    cloud.weights[k] = uniform<double>(rng, 0.1, 3);
  }
  return cloud;
}

TEST_CASE("The mean of poses balances the twists to them and commutes with changes of frame",
          "[interpolation][law]") {
  using Pose = DualQuaternion<double>;
  Rng rng(kScrewSeed);
  CAPTURE(kScrewSeed);
  for (const double spread : {1e-8, 1e-2, 0.5}) {
    for (int trial = 0; trial < kScrewTrials; ++trial) {
      const Cloud cloud = random_cloud(rng, random_pose<double>(rng), spread);
      const auto result = mean(cloud.poses, cloud.weights);
      CAPTURE(spread, result.pose, result.iterations);
      REQUIRE(result.converged);
      CHECK(result.iterations <= 30);

      Vector6<double> balance = Vector6<double>::Zero();
      Matrix<double, 8, 9> left = cloud.poses, right = cloud.poses, inverses = cloud.poses;
      const Pose frame = random_pose<double>(rng);
      for (int k = 0; k < 9; ++k) {
        const Pose x = Pose::unchecked(cloud.poses.col(k));
        balance += cloud.weights[k] / cloud.weights.sum() * x.boxminus(result.pose);
        left.col(k) = (frame * x).coeffs();
        right.col(k) = (x * frame).coeffs();
        inverses.col(k) = x.inverse().coeffs();
      }
      // The iteration stops at 16 epsilon of the largest coordinate; frames enlarge that by their lever arm.
      CHECK(balance.norm() <= 1e-13);
      CHECK((frame * result.pose).is_approx(mean(left, cloud.weights).pose, 1e-12));
      CHECK((result.pose * frame).is_approx(mean(right, cloud.weights).pose, 1e-12));
      CHECK(result.pose.inverse().is_approx(mean(inverses, cloud.weights).pose, 1e-12));
    }
  }
}

TEST_CASE("The mean of two poses is half way on their screw", "[interpolation]") {
  Rng rng(kScrewSeed);
  CAPTURE(kScrewSeed);
  for (int trial = 0; trial < kScrewTrials; ++trial) {
    const auto a = random_pose<double>(rng);
    const auto b = a.boxplus(random_twist<double>(rng, 1.0));
    WeightedSamples<double, 8, 2> samples;
    samples.points << a.coeffs(), b.coeffs();
    samples.weights << 0.5, 0.5;
    CHECK(mean(samples).pose.is_approx(sclerp(a, b, 0.5), 1e-13));
  }
}

TEST_CASE("The mean of one pose is that pose, with any number of poses of weight zero", "[interpolation]") {
  Rng rng(kScrewSeed);
  const auto x = random_pose<double>(rng);
  Eigen::Matrix<double, 8, Eigen::Dynamic> poses(8, 3);
  poses << random_pose<double>(rng).coeffs(), x.coeffs(), random_pose<double>(rng).coeffs();
  CHECK(mean(poses, Vector3<double>(0, 1, 0)).pose.is_approx(x, 1e-14));
}

TEST_CASE("Weights whose sum overflows have the mean of their ratios", "[interpolation]") {
  Rng rng(5);
  Matrix<double, 8, 2> poses;
  const auto a = random_pose<double>(rng), b = a.boxplus(Vector6<double>(0.2, 0.1, -0.3, 1.0, 0.0, 2.0));
  poses << a.coeffs(), b.coeffs();
  const auto expected = mean(poses, Vector2<double>(1.0, 0.5));
  const auto huge = mean(poses, Vector2<double>(1.7e308, 0.85e308));
  CHECK(huge.converged);
  CHECK(huge.pose.is_approx(expected.pose, 1e-13));
}

TEST_CASE("A mean that does not converge is reported", "[interpolation]") {
  Rng rng(kScrewSeed);
  const Cloud cloud = random_cloud(rng, random_pose<double>(rng), 0.5);
  CHECK_FALSE(mean(cloud.poses, cloud.weights, {.max_iterations = 1}).converged);
}

TEST_CASE("Means of no poses, negative weights or invalid poses are refused", "[interpolation][error]") {
  Rng rng(kScrewSeed);
  const Cloud cloud = random_cloud(rng, random_pose<double>(rng), 0.1);
  Cloud bad = cloud;
  bad.weights.setZero();
  CHECK_THROWS_AS(mean(bad.poses, bad.weights), std::invalid_argument);
  bad.weights = cloud.weights;
  bad.weights[3] = -0.25;
  CHECK(contains(error_message([&] { return mean(bad.poses, bad.weights); }), "-0.25"));
  CHECK_THROWS_AS(mean(cloud.poses, Vector3<double>::Ones()), std::invalid_argument);
  CHECK_THROWS_AS(mean(Eigen::Matrix<double, 8, Eigen::Dynamic>(8, 0), Eigen::VectorXd()),
                  std::invalid_argument);
  bad.weights = cloud.weights;
  bad.poses.col(5) *= 2;
  CHECK(contains(error_message([&] { return mean(bad.poses, bad.weights); }), "not a unit dual quaternion"));
}

}  // namespace
}  // namespace antipode::test
