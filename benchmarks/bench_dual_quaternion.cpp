// SPDX-License-Identifier: MIT
// Pose operations beside Eigen::Isometry3d and cv::DualQuatd, each on 256 random poses in turn.
#include <array>
#include <cstddef>
#include <vector>

#include <Eigen/StdVector>

#include <antipode/geometry/dual_quaternion.hpp>
#include <antipode/geometry/interpolation.hpp>
#include <antipode/opencv/pose.hpp>

#include "support/catch.hpp"
#include "support/random.hpp"

namespace antipode::test {
namespace {

using Catch::Benchmark::Chronometer;
using Pose = DualQuaternion<double>;

constexpr std::size_t kPoses = 256;

/// The same random poses in every representation, with a twist and a point for each.
struct Inputs {
  std::array<Pose, kPoses> poses;
  std::array<Eigen::Isometry3d, kPoses> isometries;
  std::vector<cv::DualQuatd> cv_poses;
  std::array<Vector6<double>, kPoses> twists;
  std::array<Vector3<double>, kPoses> points;

  Inputs() {
    Rng rng(1);
    for (std::size_t k = 0; k < kPoses; ++k) {
      poses[k] = random_pose<double>(rng);
      isometries[k] = poses[k].isometry();
      cv_poses.push_back(to_cv(poses[k]));
      twists[k] = random_twist<double>(rng, uniform<double>(rng, 0, 3));
      points[k] = random_matrix<double, 3, 1>(rng, 10);
    }
  }
};

/// The index of the i-th call, and of its partner where two poses are needed.
constexpr std::size_t at(int i) { return static_cast<std::size_t>(i) % kPoses; }
constexpr std::size_t next(int i) { return static_cast<std::size_t>(i + 1) % kPoses; }

TEST_CASE("Composition", "[benchmark][dual_quaternion]") {
  const Inputs in;
  BENCHMARK_ADVANCED("compose: antipode")(Chronometer meter) {
    meter.measure([&](int i) { return in.poses[at(i)] * in.poses[next(i)]; });
  };
  BENCHMARK_ADVANCED("compose: Eigen::Isometry3d")(Chronometer meter) {
    meter.measure([&](int i) { return Eigen::Isometry3d(in.isometries[at(i)] * in.isometries[next(i)]); });
  };
  BENCHMARK_ADVANCED("compose: cv::DualQuatd")(Chronometer meter) {
    meter.measure([&](int i) { return in.cv_poses[at(i)] * in.cv_poses[next(i)]; });
  };
}

TEST_CASE("Inverse", "[benchmark][dual_quaternion]") {
  const Inputs in;
  BENCHMARK_ADVANCED("inverse: antipode")(Chronometer meter) {
    meter.measure([&](int i) { return in.poses[at(i)].inverse(); });
  };
  BENCHMARK_ADVANCED("inverse: Eigen::Isometry3d")(Chronometer meter) {
    meter.measure([&](int i) { return in.isometries[at(i)].inverse(); });
  };
  BENCHMARK_ADVANCED("inverse: cv::DualQuatd")(Chronometer meter) {
    meter.measure([&](int i) { return in.cv_poses[at(i)].inv(cv::QUAT_ASSUME_UNIT); });
  };
}

TEST_CASE("Action on a point", "[benchmark][dual_quaternion]") {
  const Inputs in;
  BENCHMARK_ADVANCED("act: antipode")(Chronometer meter) {
    meter.measure([&](int i) { return in.poses[at(i)] * in.points[at(i)]; });
  };
  BENCHMARK_ADVANCED("act: Eigen::Isometry3d")(Chronometer meter) {
    meter.measure([&](int i) { return Vector3<double>(in.isometries[at(i)] * in.points[at(i)]); });
  };
  BENCHMARK_ADVANCED("act: cv::DualQuatd, x (1 + eps p) x^o")(Chronometer meter) {
    meter.measure([&](int i) {
      const cv::DualQuatd& x = in.cv_poses[at(i)];
      const Vector3<double>& p = in.points[at(i)];
      const cv::DualQuatd total_conjugate(x.w, -x.x, -x.y, -x.z, -x.w_, x.x_, x.y_, x.z_);
      return x * cv::DualQuatd(1, 0, 0, 0, 0, p[0], p[1], p[2]) * total_conjugate;
    });
  };
}

TEST_CASE("Exponential and logarithm", "[benchmark][dual_quaternion]") {
  const Inputs in;
  BENCHMARK_ADVANCED("exp: antipode")(Chronometer meter) {
    meter.measure([&](int i) { return Pose::exp(in.twists[at(i)]); });
  };
  BENCHMARK_ADVANCED("exp: cv::DualQuatd")(Chronometer meter) {
    meter.measure([&](int i) {
      const Vector6<double>& xi = in.twists[at(i)];
      return cv::exp(cv::DualQuatd(0, xi[0] / 2, xi[1] / 2, xi[2] / 2, 0, xi[3] / 2, xi[4] / 2, xi[5] / 2));
    });
  };
  BENCHMARK_ADVANCED("log: antipode")(Chronometer meter) {
    meter.measure([&](int i) { return in.poses[at(i)].log(); });
  };
  BENCHMARK_ADVANCED("log: cv::DualQuatd")(Chronometer meter) {
    meter.measure([&](int i) { return cv::log(in.cv_poses[at(i)], cv::QUAT_ASSUME_UNIT); });
  };
  BENCHMARK_ADVANCED("boxplus: antipode")(Chronometer meter) {
    meter.measure([&](int i) { return in.poses[at(i)].boxplus(in.twists[at(i)]); });
  };
  BENCHMARK_ADVANCED("boxminus: antipode")(Chronometer meter) {
    meter.measure([&](int i) { return in.poses[at(i)].boxminus(in.poses[next(i)]); });
  };
  BENCHMARK_ADVANCED("sclerp: antipode")(Chronometer meter) {
    meter.measure([&](int i) { return sclerp(in.poses[at(i)], in.poses[next(i)], 0.3); });
  };
}

TEST_CASE("Jacobians", "[benchmark][dual_quaternion]") {
  const Inputs in;
  BENCHMARK_ADVANCED("adjoint: antipode")(Chronometer meter) {
    meter.measure([&](int i) { return in.poses[at(i)].adjoint(); });
  };
  BENCHMARK_ADVANCED("exp with Jacobian: antipode")(Chronometer meter) {
    Matrix6<double> J;
    meter.measure([&](int i) { return exp(in.twists[at(i)], &J).coeffs()[0] + J(5, 2); });
  };
  BENCHMARK_ADVANCED("log with Jacobian: antipode")(Chronometer meter) {
    Matrix6<double> J;
    meter.measure([&](int i) { return log(in.poses[at(i)], &J)[0] + J(5, 2); });
  };
  BENCHMARK_ADVANCED("act with Jacobians: antipode")(Chronometer meter) {
    Matrix<double, 3, 6> J_pose;
    Matrix3<double> J_point;
    meter.measure([&](int i) {
      return act(in.poses[at(i)], in.points[at(i)], &J_pose, &J_point)[0] + J_pose(2, 5) + J_point(0, 0);
    });
  };
}

}  // namespace
}  // namespace antipode::test
