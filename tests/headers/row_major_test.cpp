// SPDX-License-Identifier: MIT
// Compiled with EIGEN_DEFAULT_TO_ROW_MAJOR, as some projects are.
#include <cstddef>
#include <vector>

#include <antipode/antipode.hpp>

#include "support/catch.hpp"

namespace antipode::test {
namespace {

using Belief = SplitPoseGaussian<double>;
using Pose = DualQuaternion<double>;

static_assert(Eigen::Matrix3d::IsRowMajor, "the flag has no effect");
static_assert(!Matrix6<double>::IsRowMajor && !Matrix<double, 3, Eigen::Dynamic>::IsRowMajor);
static_assert(Matrix<double, 1, 6>::IsRowMajor, "Eigen stores rows as rows");

/// A measured position is linear in the split chart: where it does not turn the body, the posterior is that
/// of Kalman's equations.
struct PositionMeasured {
  PositionMeasured() {
    Vector6<double> sigma, mean;
    sigma << 0.1, 0.2, 0.3, 1, 2, 3;
    mean << 0.3, -0.2, 0.5, 4, 5, 6;
    prior = {Pose::exp(mean), sigma.cwiseAbs2().asDiagonal()};
    prior.covariance(0, 1) = prior.covariance(1, 0) = 0.01;
    prior.covariance(3, 5) = prior.covariance(5, 3) = -0.7;
    R << 0.5, 0.1, 0.0, 0.1, 0.4, -0.2, 0.0, -0.2, 0.8;
    z = prior.pose.translation() + Vector3<double>(0.5, -1, 2);
    const Matrix<double, 6, 3> P_position = prior.covariance.rightCols<3>();
    const Matrix<double, 6, 3> gain = P_position * (P_position.bottomRows<3>() + R).inverse();
    covariance = prior.covariance - gain * P_position.transpose();
    shift = gain * (z - prior.pose.translation());
  }
  [[nodiscard]] GaussianMeasurements<double, 3, Vector3<double> (*)(const Pose&, std::size_t)> measurements()
      const {
    return {{{z, R}}, [](const Pose& x, std::size_t) { return Vector3<double>(x.translation()); }};
  }
  void check(const UpdateResult<Belief>& result) const {
    // The steps of a progression end at 1e-3 of a standard deviation or better.
    CHECK(result.status == UpdateStatus::kConverged);
    CHECK(result.posterior.covariance.isApprox(covariance, 1e-6));
    CHECK(SplitChart<double>::local(SplitChart<double>::retract(prior.pose, shift), result.posterior.pose)
              .norm() < 1e-6);
  }

  Belief prior;
  Vector3<double> z;
  Matrix3<double> R;
  Matrix6<double> covariance;
  Vector6<double> shift;
};

TEST_CASE("Filters give Kalman's posterior where Eigen's default is row-major", "[headers]") {
  const PositionMeasured position;
  SECTION("by the log-likelihood") {
    position.check(SplitPoseFilter<double>(position.prior).update(position.measurements()));
  }
  SECTION("by linear models") {
    position.check(LinearizedSplitPoseFilter<double>(position.prior).update(position.measurements()));
  }
}

TEST_CASE("Row-major matrices of a user convert", "[headers]") {
  Eigen::Matrix<double, 6, 6> P = Eigen::Matrix<double, 6, 6>::Identity();
  P(0, 5) = P(5, 0) = 0.25;
  const PoseGaussian<double> belief{Pose::identity(), P};
  CHECK(belief.covariance(5, 0) == 0.25);
  Eigen::Matrix3d R;
  R << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  CHECK(Pose::from_matrix(R, Eigen::Vector3d::Zero()).rotation_matrix().isApprox(R));
}

}  // namespace
}  // namespace antipode::test
