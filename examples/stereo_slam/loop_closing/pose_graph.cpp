// SPDX-License-Identifier: MIT
#include "stereo_slam/loop_closing/pose_graph.hpp"

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <utility>

#include <Eigen/Cholesky>
#include <ceres/ceres.h>
#include <fmt/format.h>

#include <antipode/ceres/pose_manifold.hpp>
#include <antipode/ceres/relative_pose_cost.hpp>
#include <antipode/distributions/pose_algebra.hpp>

namespace stereo_slam {
namespace {

using antipode::PoseManifold;
using antipode::RelativePoseCost;
using RowMajor6 = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;

/// Dynamic covariance scaling: rho(s) = s up to phi, then phi (3 s - phi) / (s + phi), which ends at 3 phi.
/// Its slope min(1, 2 phi / (s + phi))^2 is the factor on the edge's information.
class ScaledCovarianceLoss final : public ceres::LossFunction {
 public:
  explicit ScaledCovarianceLoss(double phi) : phi_(phi) {}

  [[nodiscard]] static double weight(double s, double phi) {
    const double root = s <= phi ? 1.0 : 2.0 * phi / (s + phi);
    return root * root;
  }

  void Evaluate(double s, double rho[3]) const override {
    rho[0] = s <= phi_ ? s : phi_ * (3.0 * s - phi_) / (s + phi_);
    rho[1] = weight(s, phi_);
    rho[2] = s <= phi_ ? 0.0 : -2.0 * rho[1] / (s + phi_);
  }

 private:
  double phi_;
};

void check_edge(const PoseGraphEdge& edge, std::size_t nodes) {
  if (edge.from >= nodes || edge.to >= nodes || edge.from == edge.to) {
    throw std::invalid_argument(
        fmt::format("edge from node {} to node {} in a graph of {} nodes", edge.from, edge.to, nodes));
  }
}

/// The graph as Ceres sees it. Poses are copied in; those of the gauge are constant.
class Problem {
 public:
  explicit Problem(const PoseGraph& graph) : problem_(options()) {
    for (const auto& pose : graph.poses) blocks_.push_back(pose.coeffs());
    has_edge_.assign(blocks_.size(), false);
    for (auto& block : blocks_) problem_.AddParameterBlock(block.data(), 8, &manifold_);
    for (std::size_t node = 0; node < std::min(graph.gauge, blocks_.size()); ++node) {
      problem_.SetParameterBlockConstant(blocks_[node].data());
    }
    for (const auto& edge : graph.odometry) add(edge, nullptr);
    for (const auto& edge : graph.loops) {
      losses_.push_back(std::make_unique<ceres::LossFunctionWrapper>(nullptr, ceres::TAKE_OWNERSHIP));
      loops_.push_back(add(edge, losses_.back().get()));
    }
  }

  /// Gives every loop the robust loss.
  void set_loop_scale(double phi) {
    for (auto& loss : losses_) loss->Reset(new ScaledCovarianceLoss(phi), ceres::TAKE_OWNERSHIP);
  }

  /// Squared Mahalanobis distance of every loop at the present poses.
  [[nodiscard]] std::vector<double> loop_distances() const {
    std::vector<double> result;
    for (const auto& loop : loops_) {
      double half = 0.0;
      problem_.EvaluateResidualBlock(loop, false, &half, nullptr, nullptr);
      result.push_back(2.0 * half);
    }
    return result;
  }

  [[nodiscard]] std::vector<Pose> poses() const {
    std::vector<Pose> result;
    for (const auto& block : blocks_) result.push_back(Pose::from_coefficients(block));
    return result;
  }

  [[nodiscard]] ceres::Problem& ceres() { return problem_; }
  [[nodiscard]] const double* block(std::size_t node) const { return blocks_[node].data(); }
  /// Whether a covariance exists: Ceres reports zero for blocks without residuals.
  [[nodiscard]] bool constrained(std::size_t node) const { return node == 0 || has_edge_[node]; }

 private:
  [[nodiscard]] static ceres::Problem::Options options() {
    ceres::Problem::Options options;
    options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    return options;
  }

  ceres::ResidualBlockId add(const PoseGraphEdge& edge, ceres::LossFunction* loss) {
    check_edge(edge, blocks_.size());
    has_edge_[edge.from] = has_edge_[edge.to] = true;
    return problem_.AddResidualBlock(new RelativePoseCost(edge.T_from_to.pose, edge.T_from_to.covariance),
                                     loss, blocks_[edge.from].data(), blocks_[edge.to].data());
  }

  PoseManifold manifold_;
  std::vector<antipode::Vector8<double>> blocks_;
  std::vector<bool> has_edge_;
  std::vector<std::unique_ptr<ceres::LossFunctionWrapper>> losses_;
  std::vector<ceres::ResidualBlockId> loops_;
  ceres::Problem problem_;  // last: it refers to the members above until it is destroyed
};

[[nodiscard]] ceres::Solver::Options solver_options(const PoseGraphSettings& settings) {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  // Its own code on one thread: no BLAS whose sums depend on the number of processors.
  options.sparse_linear_algebra_library_type = ceres::EIGEN_SPARSE;
  options.num_threads = 1;
  options.max_num_iterations = settings.max_iterations;
  options.logging_type = ceres::SILENT;
  return options;
}

/// Moves the problem's poses to a minimum; fills in the result's convergence and cost.
void solve(Problem& problem, const PoseGraphSettings& settings, PoseGraphResult& result) {
  ceres::Solver::Summary summary;
  ceres::Solve(solver_options(settings), &problem.ceres(), &summary);
  result.converged = summary.termination_type == ceres::CONVERGENCE;
  result.final_cost = summary.final_cost;
}

}  // namespace

PoseGraphResult optimize(const PoseGraph& graph, const PoseGraphSettings& settings) {
  constexpr double kNarrowing = 4.0;  // of the loss from one round to the next
  PoseGraphResult result;
  result.poses = graph.poses;
  result.loop_weights.assign(graph.loops.size(), 1.0);
  if (graph.poses.size() < 2 || graph.odometry.size() + graph.loops.size() == 0) {
    result.converged = true;
    return result;
  }
  Problem problem(graph);
  solve(problem, settings, result);
  if (!graph.loops.empty()) {
    const auto quadratic = problem.loop_distances();
    double phi = std::max(settings.loop_scale, *std::max_element(quadratic.begin(), quadratic.end()));
    do {
      phi = std::max(settings.loop_scale, phi / kNarrowing);
      problem.set_loop_scale(phi);
      solve(problem, settings, result);
    } while (phi > settings.loop_scale);
    const auto robust = problem.loop_distances();
    std::transform(robust.begin(), robust.end(), result.loop_weights.begin(),
                   [&](double s) { return ScaledCovarianceLoss::weight(s, settings.loop_scale); });
  }
  result.poses = problem.poses();
  std::copy_n(graph.poses.begin(), std::min(graph.gauge, graph.poses.size()),
              result.poses.begin());  // to the bit
  return result;
}

namespace {

/// Covariance blocks of a few nodes, from one decomposition.
class Marginals {
 public:
  Marginals(const PoseGraph& graph, std::span<const std::pair<std::size_t, std::size_t>> pairs,
            const PoseGraphSettings& settings)
      : problem_(graph), covariance_(options()) {
    problem_.set_loop_scale(settings.loop_scale);
    std::vector<std::pair<const double*, const double*>> blocks;
    for (const auto& [a, b] : pairs) blocks.emplace_back(problem_.block(a), problem_.block(b));
    exists_ = std::all_of(pairs.begin(), pairs.end(),
                          [&](const auto& pair) {
                            return problem_.constrained(pair.first) && problem_.constrained(pair.second);
                          }) &&
              covariance_.Compute(blocks, &problem_.ceres());
  }

  [[nodiscard]] bool exists() const { return exists_; }

  /// E[a b^T]; zero where either is the gauge.
  [[nodiscard]] Matrix6<double> block(std::size_t a, std::size_t b) const {
    RowMajor6 P = RowMajor6::Zero();
    covariance_.GetCovarianceBlockInTangentSpace(problem_.block(a), problem_.block(b), P.data());
    return P;
  }

 private:
  [[nodiscard]] static ceres::Covariance::Options options() {
    ceres::Covariance::Options options;
    options.algorithm_type = ceres::SPARSE_QR;
    options.num_threads = 1;
    return options;
  }

  Problem problem_;
  ceres::Covariance covariance_;
  bool exists_ = false;
};

}  // namespace

std::vector<Matrix6<double>> marginal_covariances(const PoseGraph& graph, std::span<const std::size_t> nodes,
                                                  const PoseGraphSettings& settings) {
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (const std::size_t node : nodes) pairs.emplace_back(node, node);
  const Marginals marginals(graph, pairs, settings);
  if (!marginals.exists()) return {};
  std::vector<Matrix6<double>> result;
  for (const std::size_t node : nodes) result.push_back(marginals.block(node, node));
  return result;
}

PoseGaussian predicted_relative_pose(const PoseGraph& graph, std::size_t from, std::size_t to,
                                     const PoseGraphSettings& settings) {
  const std::vector<std::pair<std::size_t, std::size_t>> pairs = {{from, from}, {from, to}, {to, to}};
  const Marginals marginals(graph, pairs, settings);
  if (!marginals.exists()) {
    throw std::runtime_error(fmt::format("nodes {} and {} of the pose graph are not connected", from, to));
  }
  return antipode::relative_pose<double>({graph.poses[from], marginals.block(from, from)},
                                         {graph.poses[to], marginals.block(to, to)},
                                         marginals.block(from, to));
}

double mahalanobis_squared(const PoseGraph& graph, const PoseGraphEdge& edge,
                           const CovarianceInflation& inflation, const PoseGraphSettings& settings) {
  const PoseGaussian predicted = predicted_relative_pose(graph, edge.from, edge.to, settings);
  const Vector6<double> e = edge.T_from_to.pose.boxminus(predicted.pose);
  const Matrix6<double> S =
      inflation.scale * (predicted.covariance + edge.T_from_to.covariance) + inflation.covariance;
  return e.dot(S.ldlt().solve(e));
}

}  // namespace stereo_slam
