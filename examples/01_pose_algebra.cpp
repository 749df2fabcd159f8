// SPDX-License-Identifier: MIT
//
// A robot with a camera on its mast sees a marker. Where is the marker in the world, how well is that known,
// and where was the robot half way between two poses?
//
//   T_world_robot    pose of the robot: maps robot coordinates to world coordinates
//   T_robot_camera   where the camera is mounted
//   p_camera         the marker as the camera sees it [m]
//   xi = (phi, rho)  a small motion, rotation vector [rad] first; T * exp(xi) perturbs T in its own (the
//   child's) frame P                covariance of xi, 6 x 6
#include <cstdlib>
#include <iostream>
#include <numbers>

#include <antipode/antipode.hpp>

using Pose = antipode::DualQuaternion<double>;
using Point = antipode::Vector3<double>;
using Twist = antipode::Vector6<double>;

namespace {

void expect(bool holds, const char* what) {
  if (!holds) {
    std::cerr << "unexpected: " << what << '\n';
    std::exit(EXIT_FAILURE);
  }
}

}  // namespace

int main() {
  // Poses compose, and the names give the order: neighbouring frames cancel.
  const antipode::Vector4<double> quarter_turn_left =
      antipode::quaternion_exp(Point(0, 0, std::numbers::pi / 2));
  const Pose T_world_robot = Pose::from_rotation_translation(quarter_turn_left, Point(10, 0, 0));
  const Pose T_robot_camera = Pose::from_matrix(antipode::Matrix3<double>::Identity(), Point(0.2, 0, 1.5));
  const Pose T_world_camera = T_world_robot * T_robot_camera;
  const Point p_camera(3, 0, 0);
  const Point p_world = T_world_camera * p_camera;
  std::cout << "marker in the world: " << p_world.transpose() << " m\n";
  expect((p_world - Point(10, 3.2, 1.5)).norm() < 1e-12, "the marker's position");
  expect((T_world_camera.inverse() * p_world - p_camera).norm() < 1e-12, "the way back");

  // A pose and its negative are the same pose.
  const Pose other_sign = Pose::from_coefficients(-T_world_camera.coeffs());
  expect(other_sign.is_approx(T_world_camera, 1e-15), "antipodal poses are one");

  // Jacobians come as optional outputs. The robot's heading is known to 1 degree, its position to 5 cm; the
  // mount is exact.
  Twist sigma;
  sigma << 0, 0, std::numbers::pi / 180, 0.05, 0.05, 0;
  const antipode::Matrix6<double> P_robot = sigma.cwiseAbs2().asDiagonal();
  antipode::Matrix6<double> J_robot;
  antipode::Matrix<double, 3, 6> J_camera;
  (void)antipode::compose(T_world_robot, T_robot_camera, &J_robot);
  (void)antipode::act(T_world_camera, p_camera, &J_camera);
  const antipode::Matrix<double, 3, 6> J = J_camera * J_robot;
  const Point sigma_world = (J * P_robot * J.transpose()).diagonal().cwiseSqrt();
  std::cout << "known to            : " << sigma_world.transpose() << " m\n";
  // Across the line of sight, 3.2 m of lever arm turn the degree into 5.6 cm.
  expect(std::abs(sigma_world[0] - std::hypot(0.05, 3.2 * std::numbers::pi / 180)) < 1e-12,
         "uncertainty across");
  expect(std::abs(sigma_world[1] - 0.05) < 1e-12 && sigma_world[2] < 1e-12, "uncertainty along and up");

  // The robot drives a circle: a constant twist. Half way is half the screw, not half the matrix.
  const Twist quarter_circle(0, 0, std::numbers::pi / 2, std::numbers::pi, 0, 0);  // radius 2 m
  const Pose T_world_later = T_world_robot.boxplus(quarter_circle);
  const Pose half_way = antipode::sclerp(T_world_robot, T_world_later, 0.5);
  std::cout << "half way            : " << half_way << '\n';
  const double s = 2 * std::sqrt(0.5);
  expect((half_way.translation() - Point(10 - 2 + s, s, 0)).norm() < 1e-12, "half way on the circle");
  expect((T_world_later.boxminus(T_world_robot) - quarter_circle).norm() < 1e-12, "the twist between both");
}
