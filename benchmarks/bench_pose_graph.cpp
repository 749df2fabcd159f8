// SPDX-License-Identifier: MIT
// Laps with a loop at every eighth keyframe after the first: optimisation from the open odometry, the
// prediction for one loop's gate, and the covariances of all keyframes; those of 64 keyframes by
// ceres::Covariance beside them.
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Cholesky>
#include <ceres/ceres.h>

#include <antipode/ceres/pose_manifold.hpp>
#include <antipode/ceres/relative_pose_cost.hpp>

#include "stereo_slam/loop_closing/pose_graph.hpp"
// After Ceres, whose log has a macro of the same name.
#undef CHECK
#include "support/catch.hpp"

namespace stereo_slam {
namespace {

constexpr unsigned kSeed = 1;
constexpr std::size_t kLoopEvery = 8;
constexpr double kStep_m = 3.5;

/// Three laps around a circle, with the noise that the covariances say.
[[nodiscard]] PoseGraph laps(std::size_t keyframes) {
  std::mt19937_64 random(kSeed);
  std::normal_distribution<double> normal;
  Vector6<double> sigma;
  sigma << 1e-4, 1e-4, 1e-4, 3e-3, 3e-3, 1e-2;
  const Matrix6<double> covariance = sigma.cwiseAbs2().asDiagonal();
  const std::size_t lap = keyframes / 3;
  Vector6<double> turn;
  turn << 0.0, 2.0 * std::numbers::pi / static_cast<double>(lap), 0.0, 0.0, 0.0, kStep_m;
  std::vector<Pose> truth = {Pose()};
  while (truth.size() < keyframes) truth.push_back((truth.back() * Pose::exp(turn)).renormalized());
  const auto measured = [&](std::size_t from, std::size_t to) {
    Vector6<double> error;
    for (double& e : error) e = normal(random);
    const Pose T = (truth[from].inverse() * truth[to]).boxplus(sigma.cwiseProduct(error));
    return PoseGraphEdge{from, to, {T.renormalized(), covariance}};
  };
  PoseGraph graph;
  graph.poses = {Pose()};
  for (std::size_t k = 1; k < keyframes; ++k) {
    graph.odometry.push_back(measured(k - 1, k));
    graph.poses.push_back((graph.poses.back() * graph.odometry.back().T_from_to.pose).renormalized());
    if (k >= lap && k % kLoopEvery == 0) graph.loops.push_back(measured(k - lap, k));
  }
  return graph;
}

/// What the selected inverse replaced: Ceres' sparse QR decomposition, for 64 nodes.
[[nodiscard]] bool covariances_of_64_by_ceres(const PoseGraph& graph) {
  antipode::PoseManifold manifold;
  std::vector<antipode::Vector8<double>> blocks;
  for (const Pose& pose : graph.poses) blocks.push_back(pose.coeffs());
  ceres::Problem::Options options;
  options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem problem(options);
  for (auto& block : blocks) problem.AddParameterBlock(block.data(), 8, &manifold);
  problem.SetParameterBlockConstant(blocks[0].data());
  for (const auto* edges : {&graph.odometry, &graph.loops}) {
    for (const PoseGraphEdge& edge : *edges) {
      problem.AddResidualBlock(new antipode::RelativePoseCost(edge.T_from_to.pose, edge.T_from_to.covariance),
                               nullptr, blocks[edge.from].data(), blocks[edge.to].data());
    }
  }
  std::vector<std::pair<const double*, const double*>> pairs;
  for (std::size_t k = 1; k < blocks.size(); k += 1 + blocks.size() / 64) {
    pairs.emplace_back(blocks[k].data(), blocks[k].data());
  }
  ceres::Covariance covariance(ceres::Covariance::Options{});
  return covariance.Compute(pairs, &problem);
}

TEST_CASE("Pose graph", "[benchmark][pose_graph]") {
  const PoseGraphSettings settings;
  for (const std::size_t keyframes : {200U, 1000U, 2000U, 15000U}) {
    const std::string of = std::to_string(keyframes) + " keyframes: ";
    PoseGraph graph = laps(keyframes);
    BENCHMARK(of + "optimize") { return optimize(graph, settings).final_cost; };
    graph.poses = optimize(graph, settings).poses;
    const PoseGraphEdge loop = graph.loops.back();
    BENCHMARK(of + "mahalanobis_squared") {
      return LoopPrediction(graph, settings).mahalanobis_squared(loop);
    };
    BENCHMARK(of + "marginals, all") { return marginals(graph, settings).back().estimate.covariance(0, 0); };
    BENCHMARK(of + "baseline: ceres::Covariance, 64") { return covariances_of_64_by_ceres(graph); };
  }
}

}  // namespace
}  // namespace stereo_slam
