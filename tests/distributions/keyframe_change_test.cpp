// SPDX-License-Identifier: MIT
#include <cmath>
#include <tuple>

#include <antipode/detail/cholesky.hpp>
#include <antipode/detail/standard_normal.hpp>
#include <antipode/distributions/keyframe_change.hpp>
#include <antipode/testing/check_jacobian.hpp>

#include "support/catch.hpp"
#include "support/error_message.hpp"
#include "support/random.hpp"

namespace antipode::test {
namespace {

/// Pose, velocity, gravity; biases; the extrinsics of a camera.
using Rig = ProductChart<ExtendedPoseChart<double, 3>, VectorChart<double, 6>, ScrewChart<double>>;
using Square = Matrix<double, Rig::kDim>;

[[nodiscard]] StateGaussian<Rig> random_rig(Rng& rng) {
  StateGaussian<Rig> x;
  auto& [navigation, biases, extrinsics] = x.state;
  navigation.pose = random_pose<double>(rng);
  navigation.velocity = random_matrix<double, 3, 1>(rng, 5.0);
  navigation.vectors = 9.81 * random_unit<double, 3>(rng);
  biases = random_matrix<double, 6, 1>(rng, 0.1);
  extrinsics = random_pose<double>(rng);
  x.covariance = 1e-4 * random_covariance<double, Rig::kDim>(rng, 0.1);
  return x;
}

/// The state relative to the body of `keyframe`, which is given in the same axes.
[[nodiscard]] Rig::Point seen_from(const DualQuaternion<double>& keyframe, const Rig::Point& x) {
  Rig::Point result = x;
  auto& navigation = std::get<0>(result);
  const Matrix3<double> back = keyframe.rotation_matrix().transpose();
  navigation.pose = keyframe.inverse() * navigation.pose;
  navigation.velocity = back * navigation.velocity;
  navigation.vectors = back * navigation.vectors;
  return result;
}

}  // namespace

TEST_CASE("Gravity and velocity are seen in the axes of the new keyframe", "[keyframe_change]") {
  Rng rng(1);
  const auto old = random_rig(rng);
  const auto change = change_keyframe(old);
  const auto& before = std::get<0>(old.state);
  const auto expected = seen_from(before.pose, old.state);
  CHECK(Rig::local(expected, change.state.state).norm() <= 1e-14);
  CHECK(std::get<0>(change.state.state).pose.coeffs() == DualQuaternion<double>::identity().coeffs());
  CHECK(std::get<1>(change.state.state) == std::get<1>(old.state));
  CHECK(change.link.pose.coeffs() == before.pose.coeffs());
  CHECK(change.state.covariance.topRows<3>().norm() + change.state.covariance.middleRows<3>(6).norm() == 0.0);
}

TEST_CASE("Covariances of the new state and of the link are those of the change's derivative",
          "[keyframe_change]") {
  Rng rng(2);
  const auto old = random_rig(rng);
  const auto change = change_keyframe(old);
  // State and link together are a function of the old state: its Jacobian, by differences.
  using Both = ProductChart<ExtendedPoseChart<double, 3>, VectorChart<double, 6>, ScrewChart<double>,
                            ScrewChart<double>>;
  constexpr int kBoth = Both::kDim;
  const auto both = [](const Rig::Point& x) {
    const auto& pose = std::get<0>(x).pose;
    return std::tuple_cat(seen_from(pose, x), std::tuple<DualQuaternion<double>>(pose));
  };
  Matrix<double, kBoth, Rig::kDim> J;
  constexpr double kStep = 1e-6;
  for (int j = 0; j < Rig::kDim; ++j) {
    const Vector<double, Rig::kDim> d = kStep * Vector<double, Rig::kDim>::Unit(j);
    J.col(j) = Both::local(both(Rig::retract(old.state, -d)), both(Rig::retract(old.state, d))) / (2 * kStep);
  }
  const Matrix<double, kBoth> P = J * old.covariance * J.transpose();
  const double allowed = 1e-8 * P.cwiseAbs().maxCoeff();
  CHECK(max_difference(change.state.covariance, P.topLeftCorner<Rig::kDim, Rig::kDim>()) <= allowed);
  CHECK(max_difference(change.link.covariance, P.bottomRightCorner<6, 6>()) <= allowed);
  CHECK(max_difference(change.cross, P.topRightCorner<Rig::kDim, 6>()) <= allowed);
}

TEST_CASE("Draws of the old state have the covariances after the change", "[keyframe_change][random]") {
  constexpr int kDraws = 4000;
  Rng rng(3);
  auto old = random_rig(rng);
  const auto change = change_keyframe(old);
  const Square L = detail::cholesky_factor<double, Rig::kDim>(old.covariance).value();
  Matrix<double, Rig::kDim, 6> cross = Matrix<double, Rig::kDim, 6>::Zero();
  Square covariance = Square::Zero();
  for (int i = 0; i < kDraws; ++i) {
    const auto truth = Rig::retract(old.state, L * detail::standard_normal<double, Rig::kDim>(rng));
    const auto& pose = std::get<0>(truth).pose;
    const auto error = Rig::local(change.state.state, seen_from(pose, truth));
    cross += error * pose.boxminus(change.link.pose).transpose() / kDraws;
    covariance += error * error.transpose() / kDraws;
  }
  // An entry of a sample covariance has a standard deviation of at most sqrt(2 / draws) of the variances.
  const double allowed = 5.0 * std::sqrt(2.0 / kDraws) * change.state.covariance.diagonal().maxCoeff();
  CHECK(max_difference(cross, change.cross) <= allowed);
  CHECK(max_difference(covariance, change.state.covariance) <= allowed);
}

TEST_CASE("Gravity keeps its length, and only its direction is uncertain", "[keyframe_change]") {
  Rng rng(4);
  auto state = random_rig(rng);
  auto& navigation = std::get<0>(state.state);
  navigation.vectors *= 1.01;
  const auto kept = with_gravity_length(state, 9.81);
  const auto& gravity = std::get<0>(kept.state).vectors;
  CHECK(gravity.norm() == Approx(9.81).epsilon(1e-15));
  CHECK(gravity.normalized().dot(navigation.vectors.normalized()) == Approx(1.0));
  const Vector3<double> along = navigation.pose.rotation_matrix().transpose() * gravity / 9.81;
  CHECK((kept.covariance.middleCols<3>(9) * along).norm() <= 1e-19);
  CHECK(max_difference(kept.covariance.topLeftCorner<9, 9>(), state.covariance.topLeftCorner<9, 9>()) == 0.0);
  const auto again = with_gravity_length(kept, 9.81);
  CHECK(max_difference(again.covariance, kept.covariance) <= 1e-18);

  CHECK(contains(error_message([&] { (void)with_gravity_length(state, 0.0); }),
                 "gravity is not positive and finite: 0"));
  navigation.vectors.setZero();
  CHECK(contains(error_message([&] { (void)with_gravity_length(state, 9.81); }),
                 "zero or not finite: [0; 0; 0]"));
  state.covariance(0, 1) += 1.0;
  CHECK(contains(error_message([&] { (void)change_keyframe(state); }), "not finite or not symmetric"));
}

}  // namespace antipode::test
