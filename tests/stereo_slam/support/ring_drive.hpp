// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstddef>
#include <numbers>
#include <random>
#include <vector>

#include <Eigen/Cholesky>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/loop_closing/pose_graph.hpp"
#include "stereo_slam/settings/settings.hpp"

namespace stereo_slam::test {

inline constexpr unsigned kRingSeed = 5;
inline constexpr std::size_t kRingLap = 100;    // nodes a lap
inline constexpr std::size_t kRingNodes = 180;  // the second lap follows the first

inline const PoseGraphSettings kGraphSettings{};

/// A drive around a circle, almost twice, with the odometry's and the loops' noise as their covariances say.
struct RingDrive {
  std::vector<Pose> truth;
  PoseGraph graph;
  std::mt19937_64 random{kRingSeed};

  [[nodiscard]] PoseGraphEdge measured(std::size_t from, std::size_t to, const Matrix6<double>& covariance) {
    std::normal_distribution<double> normal;
    const Matrix6<double> L = covariance.llt().matrixL();
    const Vector6<double> g = Vector6<double>::NullaryExpr([&] { return normal(random); });
    const Pose z = (truth[from].inverse() * truth[to]).boxplus(L * g);
    return {from, to, {z, covariance}};
  }

  void add_loop(std::size_t from, std::size_t to) {
    graph.loops.push_back(measured(from, to, loop_covariance()));
  }

  /// A loop that puts `to` 20 m beside where it is.
  [[nodiscard]] PoseGraphEdge false_loop(std::size_t from, std::size_t to) {
    auto edge = measured(from, to, loop_covariance());
    const Vector3<double> t = edge.T_from_to.pose.translation() + Vector3<double>(20.0, 0.0, 0.0);
    edge.T_from_to.pose = Pose::from_rotation_translation(edge.T_from_to.pose.rotation(), t);
    return edge;
  }

  [[nodiscard]] static Matrix6<double> odometry_covariance() {
    Vector6<double> sigma;
    sigma << 0.001, 0.002, 0.001, 0.02, 0.02, 0.03;
    Matrix6<double> P = sigma.cwiseAbs2().asDiagonal();
    P(1, 3) = P(3, 1) = -0.8 * sigma[1] * sigma[3];
    return P;
  }
  [[nodiscard]] static Matrix6<double> loop_covariance() {
    Vector6<double> sigma;
    sigma << 0.002, 0.002, 0.002, 0.05, 0.05, 0.08;
    return sigma.cwiseAbs2().asDiagonal();
  }
};

[[nodiscard]] inline RingDrive ring_drive(unsigned seed = kRingSeed) {
  constexpr double kStep_m = 4.0;
  RingDrive result;
  result.random.seed(seed);
  Vector6<double> turn;
  turn << 0.0, 2.0 * std::numbers::pi / static_cast<double>(kRingLap), 0.0, 0.0, 0.0, kStep_m;
  for (std::size_t k = 0; k < kRingNodes; ++k) {
    result.truth.push_back(k == 0 ? Pose() : (result.truth.back() * Pose::exp(turn)).renormalized());
  }
  result.graph.poses.push_back(Pose());
  for (std::size_t k = 1; k < kRingNodes; ++k) {
    result.graph.odometry.push_back(result.measured(k - 1, k, RingDrive::odometry_covariance()));
    result.graph.poses.push_back(
        (result.graph.poses.back() * result.graph.odometry.back().T_from_to.pose).renormalized());
  }
  return result;
}

/// Root mean square distance of the nodes from the truth; the first pose is common.
[[nodiscard]] inline double ate_m(const std::vector<Pose>& poses, const std::vector<Pose>& truth) {
  double sum = 0.0;
  for (std::size_t k = 0; k < poses.size(); ++k) {
    sum += (poses[k].translation() - truth[k].translation()).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(poses.size()));
}

/// The same with five loops between the laps.
[[nodiscard]] inline RingDrive ring_drive_with_loops(unsigned seed = kRingSeed) {
  RingDrive result = ring_drive(seed);
  for (std::size_t k = kRingLap; k < kRingNodes; k += 16) result.add_loop(k - kRingLap, k);
  return result;
}

}  // namespace stereo_slam::test
