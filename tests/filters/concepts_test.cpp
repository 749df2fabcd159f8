// SPDX-License-Identifier: MIT
#include <type_traits>

#include <antipode/cubature/gaussian_rules.hpp>
#include <antipode/distributions/bingham.hpp>
#include <antipode/distributions/bingham_gaussian.hpp>
#include <antipode/distributions/density.hpp>
#include <antipode/distributions/gaussian.hpp>
#include <antipode/filters/log_likelihood.hpp>
#include <antipode/geometry/dual_quaternion.hpp>
#include <antipode/geometry/manifold.hpp>
#include <antipode/sampling/bingham_rules.hpp>
#include <antipode/sampling/pose_rules.hpp>
#include <antipode/sampling/sample_gaussian.hpp>
#include <antipode/sampling/sigma_point_rule.hpp>

#include "support/catch.hpp"

using namespace antipode;

namespace {

using Pose = DualQuaternion<double>;
using Poses = Matrix<double, 8, 57>;
using Values = Vector<double, 57>;

struct OnePose {
  double operator()(const Pose&) const { return 0.0; }
};
struct ManyPoses {
  void operator()(const Poses&, Values& values) const { values.setOnes(); }
};
struct AnyNumberOfPoses {
  void operator()(const Eigen::Ref<const Matrix<double, 8, Eigen::Dynamic>>&,
                  Eigen::Ref<Vector<double, Eigen::Dynamic>> values) const {
    values.setConstant(2.0);
  }
};
struct Both : OnePose, ManyPoses {
  using ManyPoses::operator();
  using OnePose::operator();
};

}  // namespace

TEST_CASE("The library's own types satisfy the concepts", "[concepts]") {
  STATIC_REQUIRE(LieGroup<DualQuaternion<float>>);
  STATIC_REQUIRE(LieGroup<DualQuaternion<double>>);
  STATIC_REQUIRE(std::is_same_v<Tangent<DualQuaternion<double>>, Vector6<double>>);
  STATIC_REQUIRE(Density<Gaussian<double, 3>, Vector3<double>>);
  STATIC_REQUIRE(Density<Bingham<float, 4>, Vector4<float>>);
  STATIC_REQUIRE(Density<BinghamGaussian<double>, Pose>);
  STATIC_REQUIRE(SigmaPointRule<UnscentedRule<6>, Gaussian<double, 6>>);
  STATIC_REQUIRE(SigmaPointRule<Degree5Rule<3>, Gaussian<float, 3>>);
  STATIC_REQUIRE(SigmaPointRule<BinghamGnomonicRule, Bingham<double, 4>>);
  STATIC_REQUIRE(PoseRule<PaperPoseRule, BinghamGaussian<double>>);
  STATIC_REQUIRE(PoseRule<RichPoseRule, BinghamGaussian<float>>);
  STATIC_REQUIRE(PoseRule<JointPoseRule, BinghamGaussian<double>>);
}

TEST_CASE("The concepts reject other types", "[concepts]") {
  STATIC_REQUIRE_FALSE(Manifold<Vector3<double>>);
  STATIC_REQUIRE_FALSE(LieGroup<double>);
  STATIC_REQUIRE_FALSE(Density<Gaussian<double, 3>, Pose>);
  STATIC_REQUIRE_FALSE(SigmaPointRule<UnscentedRule<3>, Bingham<double, 4>>);
  STATIC_REQUIRE_FALSE(SigmaPointRule<int, Gaussian<double, 3>>);
  STATIC_REQUIRE_FALSE(PoseRule<UnscentedRule<3>, Gaussian<double, 3>>);
  STATIC_REQUIRE_FALSE(LogLikelihood<int, double, 57>);
  STATIC_REQUIRE_FALSE(BatchedPoseLogLikelihood<ManyPoses, double, 49>);
}

TEST_CASE("A log-likelihood takes one pose or many; the form for many is preferred", "[concepts]") {
  STATIC_REQUIRE(PoseLogLikelihood<OnePose, double>);
  STATIC_REQUIRE_FALSE(BatchedPoseLogLikelihood<OnePose, double, 57>);
  STATIC_REQUIRE(BatchedPoseLogLikelihood<ManyPoses, double, 57>);
  STATIC_REQUIRE(BatchedPoseLogLikelihood<AnyNumberOfPoses, double, 57>);
  STATIC_REQUIRE(BatchedPoseLogLikelihood<AnyNumberOfPoses, double, 225>);
  const Poses poses = Pose().coeffs().replicate<1, 57>();
  const auto values = [&](auto log_likelihood) {
    Values out = Values::Constant(-1.0);
    evaluate_log_likelihood(log_likelihood, poses, out);
    return out;
  };
  CHECK(values(OnePose{}) == Values::Zero());
  CHECK(values(ManyPoses{}) == Values::Ones());
  CHECK(values(AnyNumberOfPoses{}) == Values::Constant(2.0));
  CHECK(values(Both{}) == Values::Ones());
}
