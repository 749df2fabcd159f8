// SPDX-License-Identifier: MIT
#include "stereo_slam/loop_closing/pose_graph.hpp"

#include <cmath>
#include <cstddef>
#include <random>
#include <stdexcept>
#include <utility>
#include <vector>

#include <Eigen/Cholesky>

#include "support/catch.hpp"
#include "support/ceres.hpp"
// After it, for its CHECK.
#include <antipode/ceres/pose_manifold.hpp>
#include <antipode/ceres/relative_pose_cost.hpp>

#include "stereo_slam/core/pose_estimate.hpp"
#include "stereo_slam/support/ring_drive.hpp"

namespace stereo_slam {
namespace {

using test::ate_m;
using test::kGraphSettings;
using test::kRingLap;
using test::kRingNodes;
using test::kRingSeed;
using test::ring_drive;
using test::ring_drive_with_loops;
using test::RingDrive;

constexpr double kMaxChi2 = 22.458;  // 99.9 % of six degrees of freedom

std::vector<Matrix6<double>> covariances_of(const PoseGraph& graph, const PoseGraphSettings& settings) {
  std::vector<Matrix6<double>> result;
  for (const auto& node : marginals(graph, settings)) result.push_back(node.estimate.covariance);
  return result;
}

TEST_CASE("Loops remove the drift of drives", "[stereo_slam][pose_graph]") {
  constexpr unsigned kDrives = 20;
  double open_m = 0.0;
  double closed_m = 0.0;
  double chi2 = 0.0;
  double dof = 0.0;
  for (unsigned seed = 1; seed <= kDrives; ++seed) {
    const RingDrive d = ring_drive_with_loops(seed);
    const auto result = optimize(d.graph, kGraphSettings);
    CHECK(result.converged);
    CHECK(result.poses.front().is_approx(d.graph.poses.front(), 0.0));
    for (const double weight : result.loop_weights) CHECK(weight > 0.5);
    open_m += ate_m(d.graph.poses, d.truth);
    closed_m += ate_m(result.poses, d.truth);
    chi2 += 2.0 * result.final_cost;
    dof += 6.0 * static_cast<double>(d.graph.loops.size());
  }
  CHECK(closed_m < 0.5 * open_m);
  // Twice the cost is chi-square with as many degrees of freedom as there are loops, times six.
  CHECK(chi2 == Approx(dof).margin(4.0 * std::sqrt(2.0 * dof)));
}

TEST_CASE("Another loop bends an optimised drive within four iterations", "[stereo_slam][pose_graph]") {
  RingDrive d = ring_drive_with_loops();
  d.graph.poses = optimize(d.graph, kGraphSettings).poses;
  d.add_loop(kRingNodes - 1 - kRingLap, kRingNodes - 1);
  PoseGraphSettings few_iterations = kGraphSettings;
  few_iterations.max_iterations = 4;
  CHECK(optimize(d.graph, few_iterations).converged);
}

TEST_CASE("A false loop of 20 m among true ones changes the drive's error by less than a tenth",
          "[stereo_slam][pose_graph]") {
  CAPTURE(kRingSeed);
  RingDrive d = ring_drive_with_loops();
  const double before_m = ate_m(optimize(d.graph, kGraphSettings).poses, d.truth);
  for (const std::size_t k : {kRingLap + 1, kRingLap + 24, kRingNodes - 1}) {
    CAPTURE(k);
    RingDrive folded = d;
    folded.graph.loops.push_back(folded.false_loop(k - kRingLap, k));
    const auto result = optimize(folded.graph, kGraphSettings);
    CHECK(ate_m(result.poses, d.truth) == Approx(before_m).epsilon(0.1));
    CHECK(result.loop_weights.back() < 0.01);
  }
}

TEST_CASE("The Mahalanobis distance reveals a false loop that no other loop contradicts",
          "[stereo_slam][pose_graph]") {
  CAPTURE(kRingSeed);
  RingDrive d = ring_drive();
  CHECK(LoopPrediction(d.graph, kGraphSettings)
            .mahalanobis_squared(d.measured(0, kRingLap, RingDrive::loop_covariance())) < kMaxChi2);
  CHECK(LoopPrediction(d.graph, kGraphSettings).mahalanobis_squared(d.false_loop(0, kRingLap)) > kMaxChi2);
  // With the odometry's share taken by an earlier loop, the next false one has nowhere to hide at all.
  const double alone =
      LoopPrediction(d.graph, kGraphSettings).mahalanobis_squared(d.false_loop(4, kRingLap + 4));
  d.add_loop(0, kRingLap);
  d.graph.poses = optimize(d.graph, kGraphSettings).poses;
  CHECK(LoopPrediction(d.graph, kGraphSettings).mahalanobis_squared(d.false_loop(4, kRingLap + 4)) >
        10.0 * alone);
}

TEST_CASE("The Mahalanobis distance of an edge is what it adds to the sum of squares",
          "[stereo_slam][pose_graph]") {
  CAPTURE(kRingSeed);
  RingDrive d = ring_drive();
  const auto edge = d.measured(3, kRingLap + 5, RingDrive::loop_covariance());
  const double expected = LoopPrediction(d.graph, kGraphSettings).mahalanobis_squared(edge);
  CHECK(LoopPrediction(d.graph, kGraphSettings).mahalanobis_squared(edge, 4.0, Matrix6<double>::Identity()) <
        0.25 * expected);
  d.graph.loops.push_back(edge);
  // The odometry alone fits itself exactly, so all of the cost is the edge's. To first order in the drift.
  CHECK(2.0 * optimize(d.graph, kGraphSettings).final_cost == Approx(expected).epsilon(0.05));
}

TEST_CASE("Marginal covariances are those of the composed odometry before a loop, and shrink with it",
          "[stereo_slam][pose_graph]") {
  CAPTURE(kRingSeed);
  RingDrive d = ring_drive();
  const auto open = covariances_of(d.graph, kGraphSettings);
  REQUIRE(open.size() == kRingNodes);
  CHECK(open[0].isZero());
  PoseGaussian composed;
  for (std::size_t k = 0; k < 50; ++k)
    composed = compose_first_order(composed, d.graph.odometry[k].T_from_to);
  CHECK((open[50] - composed.covariance).norm() < 1e-6 * composed.covariance.norm());

  const auto relative = LoopPrediction(d.graph, kGraphSettings).relative_pose(20, 50);
  PoseGaussian chain;
  for (std::size_t k = 20; k < 50; ++k) chain = compose_first_order(chain, d.graph.odometry[k].T_from_to);
  CHECK(relative.pose.is_approx(chain.pose, 1e-12));
  CHECK((relative.covariance - chain.covariance).norm() < 1e-6 * chain.covariance.norm());

  d.add_loop(0, kRingLap);
  d.graph.poses = optimize(d.graph, kGraphSettings).poses;
  const auto closed = covariances_of(d.graph, kGraphSettings);
  REQUIRE(closed.size() == kRingNodes);
  CHECK(closed.back().bottomRightCorner<3, 3>().trace() < open.back().bottomRightCorner<3, 3>().trace());
}

TEST_CASE("Marginal covariances are those of Ceres, whose rank-revealing decomposition is dense",
          "[stereo_slam][pose_graph][oracle]") {
  CAPTURE(kRingSeed);
  RingDrive d = ring_drive_with_loops();
  d.graph.poses.resize(kRingLap + 17);  // two loops
  std::erase_if(d.graph.odometry, [&](const auto& edge) { return edge.to >= d.graph.poses.size(); });
  std::erase_if(d.graph.loops, [&](const auto& edge) { return edge.to >= d.graph.poses.size(); });
  d.graph.poses = optimize(d.graph, kGraphSettings).poses;

  antipode::PoseManifold manifold;
  std::vector<antipode::Vector8<double>> blocks;
  for (const Pose& pose : d.graph.poses) blocks.push_back(pose.coeffs());
  ceres::Problem::Options keep;
  keep.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem problem(keep);
  for (auto& block : blocks) problem.AddParameterBlock(block.data(), 8, &manifold);
  problem.SetParameterBlockConstant(blocks[0].data());
  for (const auto* edges : {&d.graph.odometry, &d.graph.loops}) {
    for (const auto& [from, to, T, frames, tilt] : *edges) {
      problem.AddResidualBlock(new antipode::RelativePoseCost(T.pose, T.covariance), nullptr,
                               blocks[from].data(), blocks[to].data());
    }
  }
  ceres::Covariance::Options dense;
  dense.algorithm_type = ceres::DENSE_SVD;
  ceres::Covariance expected(dense);
  std::vector<std::pair<const double*, const double*>> pairs;
  pairs.reserve(blocks.size());
  for (const auto& block : blocks) pairs.emplace_back(block.data(), block.data());
  REQUIRE(expected.Compute(pairs, &problem));

  PoseGraphSettings no_loss = kGraphSettings;
  no_loss.loop_scale = 1e6;
  const auto covariances = covariances_of(d.graph, no_loss);
  REQUIRE(covariances.size() == blocks.size());
  for (std::size_t k = 0; k < blocks.size(); ++k) {
    CAPTURE(k);
    Eigen::Matrix<double, 6, 6, Eigen::RowMajor> P;
    REQUIRE(expected.GetCovarianceBlockInTangentSpace(blocks[k].data(), blocks[k].data(), P.data()));
    CHECK((covariances[k] - P).norm() <= 1e-9 * P.norm());
  }
}

TEST_CASE("Errors after the loops are as large as the marginal covariances say",
          "[stereo_slam][pose_graph]") {
  constexpr int kRuns = 40;
  const std::vector<std::size_t> nodes = {kRingLap / 2, kRingNodes - 1};
  std::vector<double> nees(nodes.size(), 0.0);
  for (unsigned run = 0; run < kRuns; ++run) {
    RingDrive d = ring_drive(run);
    for (std::size_t k = kRingLap; k < kRingNodes; k += 30) d.add_loop(k - kRingLap, k);
    d.graph.poses = optimize(d.graph, kGraphSettings).poses;
    const auto P = covariances_of(d.graph, kGraphSettings);
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      const Vector6<double> e = d.truth[nodes[i]].boxminus(d.graph.poses[nodes[i]]);
      nees[i] += e.dot(P[nodes[i]].ldlt().solve(e)) / kRuns;
    }
  }
  for (const double mean : nees) {
    CHECK(mean > 4.98);  // 95 % interval of the mean of 40 chi-squares with six degrees of freedom
    CHECK(mean < 7.12);
  }
}

TEST_CASE("The common error adds up along the odometry, and loops reduce it", "[stereo_slam][pose_graph]") {
  CAPTURE(kRingSeed);
  constexpr double kSigma_rad = 7e-4;  // half of a link's own error
  RingDrive d = ring_drive();
  LinkedPose composed;
  LinkedPose chain;
  for (std::size_t k = 0; k < 50; ++k) {
    composed = add_link(composed, d.graph.odometry[k].T_from_to);
    if (k >= 20) chain = add_link(chain, d.graph.odometry[k].T_from_to);
  }
  const auto open = marginals(d.graph, kGraphSettings);
  CHECK(open[0].J_common.isZero());
  CHECK((open[50].J_common - composed.J_common).norm() < 1e-6 * composed.J_common.norm());

  d.graph.common_error_rad = kSigma_rad;
  const auto relative = LoopPrediction(d.graph, kGraphSettings).relative_pose(20, 50).covariance;
  const auto expected = chain.with_common_error(kSigma_rad).covariance;
  CHECK((relative - expected).norm() < 1e-6 * expected.norm());

  PoseGraph fixed = d.graph;  // up to node 20, as those of a loaded map are
  fixed.gauge = 21;
  const auto from_map = marginals(fixed, kGraphSettings);
  CHECK(from_map[20].J_common.isZero());
  CHECK((from_map[50].J_common - chain.J_common).norm() < 1e-6 * chain.J_common.norm());

  PoseGraph guessed = d.graph;
  for (std::size_t k = 0; k < 20; ++k) guessed.odometry[k].measured = false;
  const auto after_guesses = marginals(guessed, kGraphSettings);
  CHECK(after_guesses[20].J_common.norm() < 1e-6 * chain.J_common.norm());
  CHECK((after_guesses[50].J_common - chain.J_common).norm() < 1e-6 * chain.J_common.norm());

  d.add_loop(0, kRingLap);
  d.graph.poses = optimize(d.graph, kGraphSettings).poses;
  const auto closed = marginals(d.graph, kGraphSettings);
  CHECK(closed[kRingLap].J_common.norm() < 0.1 * open[kRingLap].J_common.norm());
}

TEST_CASE("Errors that the odometry has in common are as large as the covariances with them say",
          "[stereo_slam][pose_graph]") {
  constexpr int kRuns = 40;
  constexpr double kSigma_rad = 7e-4;  // half of a link's own error
  const std::vector<std::size_t> nodes = {kRingLap / 2, kRingNodes - 1};
  std::vector<double> nees(nodes.size(), 0.0);
  std::vector<double> nees_without(nodes.size(), 0.0);
  for (unsigned run = 0; run < kRuns; ++run) {
    RingDrive d = ring_drive(run);
    std::normal_distribution<double> normal;
    const Vector6<double> factors =
        kSigma_rad * Vector6<double>::NullaryExpr([&] { return normal(d.random); });
    for (auto& edge : d.graph.odometry) {
      const Vector6<double> error = factors.cwiseProduct(common_error_per_rad(edge.T_from_to));
      edge.T_from_to.pose = edge.T_from_to.pose.boxplus(error);
    }
    for (std::size_t k = kRingLap; k < kRingNodes; k += 30) d.add_loop(k - kRingLap, k);
    d.graph.poses = optimize(d.graph, kGraphSettings).poses;
    const auto P = marginals(d.graph, kGraphSettings);
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      const Vector6<double> e = d.truth[nodes[i]].boxminus(d.graph.poses[nodes[i]]);
      const Matrix6<double> S = P[nodes[i]].with_common_error(kSigma_rad).covariance;
      nees[i] += e.dot(S.ldlt().solve(e)) / kRuns;
      nees_without[i] += e.dot(P[nodes[i]].estimate.covariance.ldlt().solve(e)) / kRuns;
    }
  }
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    CHECK(nees[i] > 4.98);  // 95 % interval of the mean of 40 chi-squares with six degrees of freedom
    CHECK(nees[i] < 7.12);
    CHECK(nees_without[i] > 7.12);
  }
}

TEST_CASE("Loops that contradict the odometry beyond all measure end, and converge to finite costs only",
          "[stereo_slam][pose_graph]") {
  for (const double variance : {1e-12, 1e-40, 1e-80}) {
    CAPTURE(variance);
    RingDrive d = ring_drive();
    d.graph.poses.resize(3);
    d.graph.odometry.resize(2);
    d.graph.loops = {d.false_loop(0, 2)};
    d.graph.loops.front().T_from_to.covariance = variance * Matrix6<double>::Identity();
    const auto result = optimize(d.graph, kGraphSettings);
    CHECK((!result.converged || std::isfinite(result.final_cost)));
    for (const auto& pose : result.poses) CHECK(pose.coeffs().allFinite());
  }
}

TEST_CASE("The same graph gives the same bits", "[stereo_slam][pose_graph]") {
  const RingDrive d = ring_drive_with_loops();
  const auto first = optimize(d.graph, kGraphSettings);
  const auto second = optimize(d.graph, kGraphSettings);
  const auto P = covariances_of(d.graph, kGraphSettings);
  const auto Q = covariances_of(d.graph, kGraphSettings);
  for (std::size_t k = 0; k < kRingNodes; ++k) {
    CHECK(first.poses[k].coeffs() == second.poses[k].coeffs());
    CHECK(P[k] == Q[k]);
  }
}

TEST_CASE("Graphs without edges stay as they are; invalid edges are refused",
          "[stereo_slam][pose_graph][error]") {
  CHECK(optimize({}, kGraphSettings).poses.empty());
  PoseGraph graph;
  graph.poses = {Pose(), Pose()};
  CHECK(optimize(graph, kGraphSettings).converged);
  graph.odometry = {{0, 2, {Pose(), Matrix6<double>::Identity()}}};
  CHECK_THROWS_WITH(optimize(graph, kGraphSettings), "edge from node 0 to node 2 in a graph of 2 nodes");
  graph.odometry = {{0, 1, {Pose(), Matrix6<double>::Zero()}}};
  CHECK_THROWS_AS(optimize(graph, kGraphSettings), std::invalid_argument);
  graph.odometry = {{0, 1, {Pose(), Matrix6<double>::Identity()}}};
  graph.poses.resize(4);
  CHECK(covariances_of(graph, kGraphSettings).empty());
  graph.odometry.push_back({2, 3, {Pose(), Matrix6<double>::Identity()}});
  CHECK(covariances_of(graph, kGraphSettings).empty());
  CHECK_THROWS_AS(LoopPrediction(graph, kGraphSettings).relative_pose(0, 2), std::runtime_error);
}

}  // namespace
}  // namespace stereo_slam
