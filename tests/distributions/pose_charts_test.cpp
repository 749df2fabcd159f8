// SPDX-License-Identifier: MIT
#include <cmath>
#include <random>
#include <stdexcept>

#include <antipode/distributions/pose_charts.hpp>
#include <antipode/filters/pose_filter.hpp>

#include "filters/models.hpp"
#include "support/catch.hpp"
#include "support/error_message.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

using Pose = DualQuaternion<double>;
using Split = SplitPoseGaussian<double>;

}  // namespace

TEST_CASE("Changing the chart keeps mean and covariance to second order", "[charts][law]") {
  constexpr int kDraws = 200000;
  Rng rng(3);
  Matrix6<double> P = random_covariance<double, 6>(rng, 0.05);
  P.topRows<3>() *= 0.1;
  P.leftCols<3>() *= 0.1;
  const PoseGaussian<double> screw{random_pose<double>(rng), P};
  const Split split = in_chart<SplitChart<double>>(screw);
  Vector6<double> mean = Vector6<double>::Zero();
  Matrix6<double> second = Matrix6<double>::Zero();
  for (int i = 0; i < kDraws; ++i) {
    const Vector6<double> xi = SplitChart<double>::local(split.pose, draw(rng, screw));
    mean += xi / kDraws;
    second += xi * xi.transpose() / kDraws;
  }
  for (int i = 0; i < 6; ++i) {
    CHECK(std::abs(mean[i]) <= 4.0 * std::sqrt(split.covariance(i, i) / kDraws));
    for (int j = 0; j < 6; ++j) {
      const double sigmas = std::sqrt(split.covariance(i, i) * split.covariance(j, j));
      CHECK(std::abs(second(i, j) - split.covariance(i, j)) <= 4.0 * sigmas * std::sqrt(2.0 / kDraws));
    }
  }
  // There and back, what is lost is of third order: the rotation's variance times itself.
  const auto back = in_chart<ScrewChart<double>>(split);
  CHECK(max_difference(back.covariance, P) <= 5e-3);
  CHECK(back.pose.boxminus(screw.pose).norm() <= 5e-3);
}

TEST_CASE("A Bingham density with its translation is rotation and position apart", "[charts][law]") {
  Rng rng(7);
  const Split split{random_pose<double>(rng),
                    Matrix6<double>(1e-4 * random_covariance<double, 6>(rng, 0.05))};
  const Split back = to_split_pose_gaussian(to_bingham_gaussian(split));
  CHECK(back.pose.is_approx(split.pose, 1e-12));
  CHECK(back.covariance.isApprox(split.covariance, 1e-3));
  CHECK((to_bingham_gaussian(split).translation_covariance() - split.covariance.bottomRightCorner<3, 3>())
            .norm() <= 1e-3 * split.covariance.norm());
}

TEST_CASE("A certain pose is certain in every chart", "[charts]") {
  Rng rng(4);
  const auto pose = random_pose<double>(rng);
  const Split split = in_chart<SplitChart<double>>(PoseGaussian<double>{pose, Matrix6<double>::Zero()});
  CHECK(split.pose.is_approx(pose, 1e-14));
  CHECK(split.covariance.isZero());
}

TEST_CASE("The chart that a density is in already leaves it alone", "[charts]") {
  Rng rng(8);
  const Split split{random_pose<double>(rng), random_covariance<double, 6>(rng)};
  const auto same = in_chart<SplitChart<double>>(split);
  CHECK(same.pose.coeffs() == split.pose.coeffs());
  CHECK(same.covariance == split.covariance);
}

TEST_CASE("A lever turns an uncertain heading into an uncertain position in the split chart only",
          "[charts]") {
  // The screw chart's origin is the body: a heading error of the body leaves its own position alone in both.
  Rng rng(9);
  const auto pose = random_pose<double>(rng);
  const PoseGaussian<double> screw{pose, pose_covariance<double>(0.02, 0.5)};
  const Split split = in_chart<SplitChart<double>>(screw);
  CHECK(split.covariance.topLeftCorner<3, 3>().isApprox(screw.covariance.topLeftCorner<3, 3>(), 1e-3));
  CHECK(
      split.covariance.bottomRightCorner<3, 3>().isApprox(screw.covariance.bottomRightCorner<3, 3>(), 1e-3));
  const PoseGaussian<double> body_axes{pose, Vector6<double>(0.01, 0.01, 0.01, 1.0, 4.0, 9.0).asDiagonal()};
  const Matrix3<double> R = pose.rotation_matrix();
  const Matrix3<double> in_parent = R * Vector3<double>(1.0, 4.0, 9.0).asDiagonal() * R.transpose();
  CHECK(
      in_chart<SplitChart<double>>(body_axes).covariance.bottomRightCorner<3, 3>().isApprox(in_parent, 0.03));
}

TEST_CASE("Changing the chart ignores the sign of the quaternion", "[charts][law]") {
  Rng rng(10);
  const PoseGaussian<double> screw{random_pose<double>(rng),
                                   Matrix6<double>(0.01 * random_covariance<double, 6>(rng))};
  const auto split = in_chart<SplitChart<double>>(screw);
  const auto other =
      in_chart<SplitChart<double>>(PoseGaussian<double>{antipode_of(screw.pose), screw.covariance});
  CHECK(other.pose.is_approx(split.pose, 1e-14));
  CHECK(other.covariance.isApprox(split.covariance, 1e-12));
}

TEST_CASE("What is no covariance is refused on the way to another chart", "[charts][error]") {
  const PoseGaussian<double> negative{Pose::identity(), Matrix6<double>(-Matrix6<double>::Identity())};
  CHECK(contains(error_message([&] { (void)in_chart<SplitChart<double>>(negative); }),
                 "pose covariance has a negative eigenvalue"));
  const PoseGaussian<double> nan{Pose::identity(), Matrix6<double>::Constant(std::nan(""))};
  CHECK(contains(error_message([&] { (void)in_chart<SplitChart<double>>(nan); }),
                 "pose covariance is not finite or not symmetric"));
  const Split too_wide{Pose::identity(), pose_covariance<double>(10.0, 1.0)};
  CHECK_THROWS_AS(to_bingham_gaussian(too_wide), std::invalid_argument);
}

TEST_CASE("A covariance of which only one triangle is set has no other chart", "[charts][error]") {
  Split triangle{Pose(), Matrix6<double>(1e-4 * Matrix6<double>::Identity())};
  triangle.covariance(1, 5) = 5e-5;
  const auto refused = [](const auto& f) {
    return contains(error_message(f), "pose covariance is not finite or not symmetric: [");
  };
  CHECK(refused([&] { return to_bingham_gaussian(triangle); }));
  CHECK(refused([&] { return in_chart<ScrewChart<double>>(triangle); }));
  CHECK(refused([&] { return in_chart<SplitChart<double>>(triangle); }));
}

TEMPLATE_TEST_CASE("A known pose is known in every chart, and filters start with it", "[charts]", float,
                   double) {
  using Scalar = TestType;
  Rng rng(7);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (int trial = 0; trial < 200; ++trial) {
    CAPTURE(trial);
    Vector6<Scalar> xi;
    for (auto& x : xi) x = Scalar(uniform(rng));
    xi.template tail<3>() *= Scalar(100);
    const PoseGaussian<Scalar> known{DualQuaternion<Scalar>::exp(xi), Matrix6<Scalar>::Zero()};
    const auto split = in_chart<SplitChart<Scalar>>(known);
    CHECK(split.covariance.cwiseAbs().maxCoeff() < Scalar(1e-12));
    CHECK_NOTHROW(SplitPoseFilter<Scalar>(split));
    CHECK_NOTHROW(QuadraticPoseFilter<Scalar>(in_chart<ScrewChart<Scalar>>(split)));
  }
}
