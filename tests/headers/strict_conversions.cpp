// SPDX-License-Identifier: MIT
// What a user with -Wconversion -Wsign-conversion sees: the library instantiated in single and double
// precision.
#include <cstddef>
#include <optional>
#include <random>
#include <vector>

#include <antipode/antipode.hpp>

namespace antipode {
namespace {

template <class Scalar>
class Instances {
 public:
  void distributions() {
    (void)fuse(x, x);
    (void)nees(x, sample(x, rng));
    (void)translation_marginal(x);
    (void)orientation_marginal(x).sample(rng);
    (void)from_ros_covariance(x.pose, to_ros_covariance(x));
    (void)from_left_covariance(x.pose, to_left_covariance(x));
    (void)compose(x, x);
    (void)inverse(x);
    (void)relative_pose(x, x);
    (void)propagate(CubatureRule<6>{}, x, [](const Pose& pose) { return pose.inverse(); });
    const auto bingham = to_bingham_gaussian(x);
    (void)compose(bingham.orientation(), bingham.orientation());
    (void)sample(RichPoseRule{}, bingham);
    (void)sample(JointPoseRule{}, bingham);
  }

  void mixtures() {
    const Matrix6<Scalar> P = Matrix6<Scalar>::Identity() / Scalar(100);
    const ProjectedGaussian<Scalar> density(Pose(), P);
    const Mixture<ProjectedGaussian<Scalar>> mixture(density);
    (void)reduce(fuse(mixture, mixture).mixture, {.max_components = 1});
    (void)moment_match(mixture);
    (void)density.sample(rng);
    (void)relative_pose(density, density);
    const PushForwardGaussian<Scalar> projected(Pose(), P);
    (void)compose(projected, projected, Transport::kUnscented);
    MixtureFilter<Scalar> filter(mixture);
    (void)filter.predict(mixture);
    (void)filter.update(mixture);
  }

  void filters() {
    const auto h = [](const Pose& pose, std::size_t) { return Vector3<Scalar>(pose.translation()); };
    const std::vector<NoisyMeasurement<Scalar, 3>> z = {
        {Vector3<Scalar>::Zero(), Matrix3<Scalar>::Identity()}};
    const GaussianMeasurements gaussian(z, h);
    const RobustMeasurements student(z, h, StudentT<Scalar>{});
    update<QuadraticPoseFilter<Scalar>>(gaussian);
    update<QuadraticPoseFilter<Scalar>>(student);
    update<LinearizedPoseFilter<Scalar>>(gaussian);
    update<RichPoseFilter<Scalar>>(gaussian);
    update<PaperPoseFilter<Scalar>>(gaussian);
    (void)quadratic_update(x, RobustMeasurements(z, h, Contamination<Scalar>{}));
    SplitPoseFilter<Scalar> split(SplitPoseGaussian<Scalar>{Pose(), Matrix6<Scalar>::Identity()});
    (void)split.update(gaussian);
    const auto h_with_jacobian = [h](const Pose& pose, std::size_t i, Matrix<Scalar, 3, 6>& J) {
      J.setZero();
      return h(pose, i);
    };
    (void)gauss_newton_update(x, z, h_with_jacobian);
    (void)linearized_update(x, z, with_angles<0>(z, h));
    SmoothingFilter<LinearizedPoseFilter<Scalar>> smoothing{LinearizedPoseFilter<Scalar>(x)};
    smoothing.predict(Pose(), x);
    (void)smoothing.commit(smoothing.propose(gaussian));
    (void)smoothing.smoothed();
    using Navigation = ExtendedPoseChart<Scalar, 3>;
    const StateGaussian<Navigation> navigation;
    (void)nees(navigation, Navigation::retract(navigation.state, Navigation::local({}, navigation.state)));
    using AnyRows = NoisyMeasurement<Scalar, Eigen::Dynamic>;
    (void)linearized_update(x, std::vector<AnyRows>{{z[0].z, z[0].R}}, [&](const Pose& pose, std::size_t i) {
      return Vector<Scalar, Eigen::Dynamic>(h(pose, i));
    });
  }

  void sensors() {
    const StereoCamera<Scalar> camera{Scalar(700), Scalar(700), Scalar(0), Scalar(0), Scalar(0.5)};
    const InverseDepthLandmark<Scalar> landmark{Pose(), Vector3<Scalar>(1, 2, 3),
                                                Matrix3<Scalar>::Identity()};
    (void)landmark.seen_from(camera, Pose());
    (void)unscented_update(
        Gaussian<Scalar, 3>(landmark.mean, landmark.covariance), Pose(),
        [&](const Pose& pose, const Vector3<Scalar>& uvd) { return landmark.project(camera, pose, uvd); },
        NoisyMeasurement<Scalar, 3>{landmark.mean, landmark.covariance});
    const std::vector<ImuSample<Scalar>> samples(2);
    const auto motion = integrate_imu(samples, {0, 0}, Vector6<Scalar>::Zero(), ImuNoise<Scalar>{});
    using Inertial = InertialChart<Scalar, VectorChart<Scalar, 1>>;
    PoseFilter<StateGaussian<Inertial>, MysovskikhRule<6>, PoseMarginalUpdate<QuadraticProgression<Scalar>>>
        filter{StateGaussian<Inertial>{}};
    filter.predict(motion, motion.template jacobian_in<Inertial>(), motion.template noise_in<Inertial>());
    (void)filter.update([](const Pose&) { return Scalar(0); });
    (void)with_gravity_length(change_keyframe(filter.density()).state, Scalar(1));
    (void)bingham_from_gravity(Vector3<Scalar>(0, 0, 1), Vector3<Scalar>(0, 0, 1), Scalar(1));
    const Eigen::Matrix<Scalar, 3, Eigen::Dynamic> cloud = Eigen::Matrix<Scalar, 3, 4>::Zero();
    (void)act(Pose(), cloud);
  }

 private:
  using Pose = DualQuaternion<Scalar>;

  template <class Filter, class Measurement>
  void update(const Measurement& z) {
    Filter filter(x);
    filter.predict(Pose(), x);
    (void)filter.update(z);
  }

  PoseGaussian<Scalar> x{Pose(), Matrix6<Scalar>::Identity()};
  std::mt19937 rng{1};
};

}  // namespace

template <class Scalar>
void instantiate() {
  Instances<Scalar> all;
  all.distributions();
  all.mixtures();
  all.filters();
  all.sensors();
}
template void instantiate<float>();
template void instantiate<double>();

}  // namespace antipode
