// SPDX-License-Identifier: MIT
#include <cmath>
#include <tuple>

#include <antipode/geometry/chart.hpp>
#include <antipode/geometry/extended_pose.hpp>
#include <antipode/testing/check_jacobian.hpp>

#include "support/catch.hpp"
#include "support/random.hpp"

namespace antipode::test {
namespace {

using Pose = DualQuaternion<double>;
using Joint = ProductChart<SplitChart<double>, VectorChart<double, 3>>;

/// The position a second later, and its Jacobian with one entry changed by `error`.
struct NextPosition {
  Vector3<double> operator()(const Joint::Point& x) const {
    return std::get<0>(x).translation() + std::get<1>(x);
  }
  static Matrix<double, 3, 9> jacobian(double error) {
    Matrix<double, 3, 9> J = Matrix<double, 3, 9>::Zero();
    J.middleCols<3>(3).setIdentity();
    J.rightCols<3>().setIdentity();
    J(1, 2) += error;
    return J;
  }
};

TEST_CASE("The Jacobian of a measurement of a joint state is checked in its chart", "[testing]") {
  Rng rng(8);
  const Joint::Point x{random_pose<double>(rng), Vector3<double>(1, -2, 3)};
  CHECK(testing::check_jacobian_over<Joint>(NextPosition{}, x, NextPosition::jacobian(0)));
  CHECK_FALSE(testing::check_jacobian_over<Joint>(NextPosition{}, x, NextPosition::jacobian(1e-6)));
  CHECK_FALSE(testing::check_jacobian_over<Joint>(NextPosition{}, x, NextPosition::jacobian(std::nan(""))));
}

TEST_CASE("The Jacobian of a motion of a joint state is checked in its chart", "[testing]") {
  Rng rng(9);
  const Joint::Point x{random_pose<double>(rng), Vector3<double>(1, -2, 3)};
  const auto moved = [](const Joint::Point& state) {
    const auto& [pose, v] = state;
    return Joint::Point{Pose::from_rotation_translation(pose.rotation(), pose.translation() + 0.1 * v), v};
  };
  Matrix<double, 9> F = Matrix<double, 9>::Identity();
  F.block<3, 3>(3, 6).diagonal().setConstant(0.1);
  CHECK(testing::check_jacobian_over<Joint, Joint>(moved, x, F));
  F(3, 6) = 0.2;
  CHECK_FALSE(testing::check_jacobian_over<Joint, Joint>(moved, x, F));
}

TEST_CASE("Coordinates of millions of metres do not spoil the check of a Jacobian", "[testing]") {
  // Their differences have rounding errors of 1e-9 m over the step: the tolerance grows with them.
  const Joint::Point utm{
      Pose::from_rotation_translation(Vector4<double>(1, 0, 0, 0), Vector3<double>(6.9e5, 5.3e6, 500)),
      Vector3<double>::Zero()};
  CHECK(testing::check_jacobian_over<Joint>(NextPosition{}, utm, NextPosition::jacobian(0)));
  CHECK(testing::check_jacobian_over<Joint, Joint>([](const Joint::Point& x) { return x; }, utm,
                                                   Matrix<double, 9>(Matrix<double, 9>::Identity())));
}

}  // namespace
}  // namespace antipode::test
