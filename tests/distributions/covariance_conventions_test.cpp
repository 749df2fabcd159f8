// SPDX-License-Identifier: MIT
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <antipode/distributions/covariance_conventions.hpp>

#include "support/catch.hpp"
#include "support/error_message.hpp"
#include "support/random.hpp"

using namespace antipode;
using namespace antipode::test;

namespace {

using Pose = DualQuaternion<double>;
using Density = PoseGaussian<double>;

Matrix6<double> diagonal(double a, double b, double c, double d, double e, double f) {
  Vector6<double> v;
  v << a, b, c, d, e, f;
  return v.asDiagonal();
}

Matrix6<double> as_matrix(const std::array<double, 36>& rows) {
  Matrix6<double> P;
  for (std::size_t k = 0; k < 36; ++k) P(static_cast<int>(k / 6), static_cast<int>(k % 6)) = rows[k];
  return P;
}

/// J S J^T for the error of another convention that a small xi of this library's is, by central differences.
template <class Error>
Matrix6<double> transformed(const Density& x, const Error& error) {
  constexpr double kStep = 1e-6;
  Matrix6<double> J;
  for (int i = 0; i < 6; ++i) {
    const Vector6<double> xi = kStep * Vector6<double>::Unit(i);
    J.col(i) = (error(x.pose.boxplus(xi)) - error(x.pose.boxplus(-xi))) / (2.0 * kStep);
  }
  return J * x.covariance * J.transpose();
}

}  // namespace

TEST_CASE("A heading error far from the origin is no position error in ROS, but is one on the left",
          "[conventions]") {
  // 100 m along x of the world, turned by 90 degrees about z: x of the body is y of the world. Heading 1
  // mrad; 0.1 m ahead (x of the body), 0.2 m sideways.
  const double h = std::sqrt(0.5);
  const Pose T = Pose::from_rotation_translation(Vector4<double>(h, 0, 0, h), Vector3<double>(100, 0, 0));
  const Density x{T, diagonal(4e-6, 9e-6, 1e-6, 0.01, 0.04, 0.09)};

  const Matrix6<double> ros = as_matrix(to_ros_covariance(x));
  CHECK(max_difference(ros, diagonal(0.04, 0.01, 0.09, 9e-6, 4e-6, 1e-6)) <= 1e-15);

  CHECK(max_difference(to_sophus_covariance(x), diagonal(0.01, 0.04, 0.09, 4e-6, 9e-6, 1e-6)) == 0.0);
  CHECK(max_difference(to_gtsam_covariance(x), x.covariance) == 0.0);

  // exp(xi) T: p = R phi, r = R rho - p x t..., so that y moves by another -100 m * p_z, and z by 100 m *
  // p_y.
  Matrix6<double> left = diagonal(9e-6, 4e-6, 1e-6, 0.04, 0.01 + 1e4 * 1e-6, 0.09 + 1e4 * 4e-6);
  left(2, 4) = left(4, 2) = -100.0 * 1e-6;
  left(1, 5) = left(5, 1) = 100.0 * 4e-6;
  CHECK(max_difference(to_left_covariance(x), left) <= 1e-15);
}

TEST_CASE("Every convention is the derivative of its own error", "[conventions]") {
  for (unsigned seed = 0; seed < 10; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const Density x{random_pose<double>(rng), random_covariance<double, 6>(rng)};
    const auto swapped = [](const Vector6<double>& e) {
      Vector6<double> f;
      f << e.tail<3>(), e.head<3>();
      return f;
    };
    const auto right = [&](const Pose& y) { return Vector6<double>(y.boxminus(x.pose)); };
    const auto left = [&](const Pose& y) { return Vector6<double>((y * x.pose.inverse()).log()); };
    const auto ros = [&](const Pose& y) {
      Vector6<double> e;
      e << y.translation() - x.pose.translation(), left(y).head<3>();
      return e;
    };
    // The differences lose 1e-10 of 1; the entries are up to |t|^2 = 100.
    CHECK(max_difference(to_gtsam_covariance(x), transformed(x, right)) <= 1e-7);
    CHECK(max_difference(to_sophus_covariance(x),
                         transformed(x, [&](const Pose& y) { return swapped(right(y)); })) <= 1e-7);
    CHECK(max_difference(to_left_covariance(x), transformed(x, left)) <=
          1e-7 * (1.0 + x.pose.translation().squaredNorm()));
    CHECK(max_difference(as_matrix(to_ros_covariance(x)), transformed(x, ros)) <= 1e-7);
  }
}

TEST_CASE("Conversions there and back change nothing", "[conventions][law]") {
  for (unsigned seed = 0; seed < 10; ++seed) {
    CAPTURE(seed);
    Rng rng(seed);
    const Density x{random_pose<double>(rng), random_covariance<double, 6>(rng)};
    const double tolerance = 1e-14 * (1.0 + x.pose.translation().squaredNorm());
    CHECK(max_difference(from_gtsam_covariance(x.pose, to_gtsam_covariance(x)).covariance, x.covariance) ==
          0.0);
    CHECK(max_difference(from_sophus_covariance(x.pose, to_sophus_covariance(x)).covariance, x.covariance) ==
          0.0);
    CHECK(max_difference(from_left_covariance(x.pose, to_left_covariance(x)).covariance, x.covariance) <=
          50.0 * tolerance);
    CHECK(max_difference(from_ros_covariance(x.pose, to_ros_covariance(x)).covariance, x.covariance) <=
          tolerance);
  }
}

namespace {

/// Every conversion of the covariance, applied to P.
[[nodiscard]] std::vector<std::function<void()>> all_conversions(const Matrix6<double>& P) {
  std::array<double, 36> rows;
  for (std::size_t k = 0; k < 36; ++k) rows[k] = P(static_cast<int>(k / 6), static_cast<int>(k % 6));
  const Pose x = Pose::identity();
  return {[=] { (void)to_gtsam_covariance(Density{x, P}); },  [=] { (void)from_gtsam_covariance(x, P); },
          [=] { (void)to_sophus_covariance(Density{x, P}); }, [=] { (void)from_sophus_covariance(x, P); },
          [=] { (void)to_left_covariance(Density{x, P}); },   [=] { (void)from_left_covariance(x, P); },
          [=] { (void)to_ros_covariance(Density{x, P}); },    [=] { (void)from_ros_covariance(x, rows); }};
}

void check_refused(const Matrix6<double>& P, const std::string& reason) {
  for (const auto& conversion : all_conversions(P)) CHECK(contains(error_message(conversion), reason));
}

}  // namespace

TEST_CASE("A covariance of which only one triangle is set is refused with its value",
          "[conventions][error]") {
  const Matrix6<double> P = diagonal(0.1, 0.1, 0.1, 2, 2, 2);
  for (const auto& [i, j] : {std::pair(0, 4), std::pair(4, 0), std::pair(1, 2), std::pair(5, 3)}) {
    Matrix6<double> triangle = P;
    triangle(i, j) = 0.03;
    check_refused(triangle, "not finite or not symmetric: [");
    check_refused(triangle, "0.03");
    triangle(j, i) = 0.03;
    for (const auto& conversion : all_conversions(triangle)) CHECK_NOTHROW(conversion());
  }
}

TEST_CASE("A covariance with NaN, infinity or a negative variance is refused", "[conventions][error]") {
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    Matrix6<double> P = diagonal(0.1, 0.1, 0.1, 2, 2, 2);
    P(2, 2) = bad;
    check_refused(P, "not finite or not symmetric");
  }
  check_refused(diagonal(0.1, 0.1, 0.1, -1, 2, 2), "negative eigenvalue");
}

TEST_CASE("A ROS covariance of zeros or with -1 first is unknown, and not that of an exact pose",
          "[conventions][error]") {
  std::array<double, 36> rows{};
  const auto refusal = [&] {
    return error_message([&] { (void)from_ros_covariance(Pose::identity(), rows); });
  };
  CHECK_FALSE(ros_covariance_is_known(rows));
  CHECK(contains(refusal(), "unknown (all zeros, or -1 first)"));
  rows.fill(-0.0);
  CHECK_FALSE(ros_covariance_is_known(rows));
  rows.fill(0.0);
  rows[0] = -1;
  CHECK_FALSE(ros_covariance_is_known(rows));
  CHECK(contains(refusal(), "unknown (all zeros, or -1 first)"));
  rows[0] = -0.5;
  CHECK(ros_covariance_is_known(rows));
  CHECK(contains(refusal(), "negative eigenvalue"));
  // A robot on wheels reports zeros for what cannot vary.
  rows[0] = rows[7] = 0.01;
  rows[35] = 0.001;
  CHECK(ros_covariance_is_known(rows));
  CHECK(from_ros_covariance(Pose::identity(), rows).covariance(2, 2) == 0.001);
  // The nine numbers of sensor_msgs/Imu.
  CHECK_FALSE(ros_covariance_is_known(std::array<double, 9>{-1}));
  CHECK(ros_covariance_is_known(std::array<double, 9>{1e-4, 0, 0, 0, 1e-4, 0, 0, 0, 1e-4}));
}
