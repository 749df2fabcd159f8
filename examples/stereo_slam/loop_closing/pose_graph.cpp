// SPDX-License-Identifier: MIT
#include "stereo_slam/loop_closing/pose_graph.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <stdexcept>
#include <utility>

#include <ceres/ceres.h>
#include <fmt/format.h>

#include <antipode/ceres/pose_manifold.hpp>
#include <antipode/ceres/relative_pose_cost.hpp>
#include <antipode/distributions/pose_algebra.hpp>

#include "stereo_slam/core/symmetric_solve.hpp"
#include "stereo_slam/loop_closing/selected_inverse.hpp"
#include "stereo_slam/loop_closing/tilt_cost.hpp"

namespace stereo_slam {
namespace {

using antipode::PoseManifold;
using antipode::RelativePoseCost;

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
    for (auto& block : blocks_) problem_.AddParameterBlock(block.data(), 8, &manifold_);
    for (std::size_t node = 0; node < std::min(graph.gauge, blocks_.size()); ++node) {
      problem_.SetParameterBlockConstant(blocks_[node].data());
    }
    for (const auto& edge : graph.odometry) add(edge, nullptr);
    for (const auto& edge : graph.loops) {
      losses_.push_back(std::make_unique<ceres::LossFunctionWrapper>(nullptr, ceres::TAKE_OWNERSHIP));
      loops_.push_back(add(edge, losses_.back().get()));
    }
    for (const auto& edge : graph.odometry) {
      if (!edge.tilt || edge.tilt->whitening.isZero(0.0)) continue;
      problem_.AddResidualBlock(new TiltCost(*edge.tilt), nullptr, blocks_.at(graph.first).data(),
                                blocks_[edge.to].data());
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
  [[nodiscard]] double* block(std::size_t node) { return blocks_[node].data(); }

 private:
  [[nodiscard]] static ceres::Problem::Options options() {
    ceres::Problem::Options options;
    options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    return options;
  }

  ceres::ResidualBlockId add(const PoseGraphEdge& edge, ceres::LossFunction* loss) {
    check_edge(edge, blocks_.size());
    return problem_.AddResidualBlock(new RelativePoseCost(edge.T_from_to.pose, edge.T_from_to.covariance),
                                     loss, blocks_[edge.from].data(), blocks_[edge.to].data());
  }

  PoseManifold manifold_;
  std::vector<antipode::Vector8<double>> blocks_;
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
  // Practically no damping to begin with: it would slow just the long chains of keyframes, which a loop bends
  // as a whole.
  constexpr double kFirstRadius = 1e12;
  options.initial_trust_region_radius = kFirstRadius;
  options.logging_type = ceres::SILENT;
  return options;
}

/// Moves the problem's poses to a minimum; fills in the result's convergence and cost.
void solve(Problem& problem, const PoseGraphSettings& settings, PoseGraphResult& result) {
  ceres::Solver::Summary summary;
  ceres::Solve(solver_options(settings), &problem.ceres(), &summary);
  result.converged = summary.termination_type == ceres::CONVERGENCE && std::isfinite(summary.final_cost);
  result.final_cost = summary.final_cost;
}

}  // namespace

PoseGraphResult optimize(const PoseGraph& graph, const PoseGraphSettings& settings) {
  constexpr double kNarrowing = 4.0;  // of the loss from one round to the next
  constexpr double kWidest = 1e12;    // times the last loss: 20 rounds, however absurd a loop is
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
    double phi = std::clamp(*std::max_element(quadratic.begin(), quadratic.end()), settings.loop_scale,
                            kWidest * settings.loop_scale);
    while (phi > settings.loop_scale) {
      phi = std::max(settings.loop_scale, phi / kNarrowing);
      problem.set_loop_scale(phi);
      solve(problem, settings, result);
    }
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

/// Which nodes the edges connect with a fixed one.
[[nodiscard]] std::vector<bool> connected_to_gauge(const PoseGraph& graph) {
  std::vector<std::vector<std::size_t>> neighbours(graph.poses.size());
  for (const auto* edges : {&graph.odometry, &graph.loops}) {
    for (const auto& edge : *edges) {
      neighbours[edge.from].push_back(edge.to);
      neighbours[edge.to].push_back(edge.from);
    }
  }
  std::vector<bool> reached(graph.poses.size(), false);
  std::vector<std::size_t> waiting;
  const auto reach = [&](std::size_t node) {
    if (reached[node]) return;
    reached[node] = true;
    waiting.push_back(node);
  };
  for (std::size_t node = 0; node < std::min(graph.gauge, graph.poses.size()); ++node) reach(node);
  while (!waiting.empty()) {
    const std::size_t node = waiting.back();
    waiting.pop_back();
    for (const std::size_t neighbour : neighbours[node]) reach(neighbour);
  }
  return reached;
}

}  // namespace

/// Information of the poses that may move, given the others: the decomposed Gauss-Newton matrix at the
/// graph's poses, with six variables a node.
class GraphInformation {
  using RowMajor = Eigen::SparseMatrix<double, Eigen::RowMajor>;
  using MatrixX6 = Eigen::Matrix<double, Eigen::Dynamic, 6>;

 public:
  GraphInformation(const PoseGraph& graph, const PoseGraphSettings& settings) {
    Problem problem(graph);
    problem.set_loop_scale(settings.loop_scale);
    const auto connected = connected_to_gauge(graph);
    std::vector<double*> movable;
    for (std::size_t node = 0; node < graph.poses.size(); ++node) {
      const bool fixed = node < graph.gauge;
      first_variable_.push_back(fixed ? kFixed : connected[node] ? variables_ : kUnknown);
      if (fixed || !connected[node]) continue;
      movable.push_back(problem.block(node));
      variables_ += 6;
    }
    if (variables_ > 0) decompose(problem.ceres(), movable, graph.odometry);
  }

  /// Whether the node's covariance exists: it is connected to the gauge.
  [[nodiscard]] bool knows(std::size_t node) const { return first_variable_[node] != kUnknown; }

  /// The covariances of two nodes and that between them; zero where either is fixed.
  struct PairCovariance {
    Matrix6<double> first = Matrix6<double>::Zero();
    Matrix6<double> second = Matrix6<double>::Zero();
    Matrix6<double> first_second = Matrix6<double>::Zero();  // E[first second^T]
  };
  [[nodiscard]] PairCovariance covariances(std::size_t first, std::size_t second) const {
    const int row_1 = first_variable_[first], row_2 = first_variable_[second];
    PairCovariance result;
    if (row_1 >= 0) result.first = columns_of_inverse(row_1).middleRows<6>(row_1);
    if (row_2 < 0) return result;
    const MatrixX6 columns = columns_of_inverse(row_2);
    result.second = columns.middleRows<6>(row_2);
    if (row_1 >= 0) result.first_second = columns.middleRows<6>(row_1);
    return result;
  }

  /// LinkedPose::J_common of the node; zero if the node is fixed.
  [[nodiscard]] Matrix6<double> J_common(std::size_t node) const {
    const int row = first_variable_[node];
    if (row < 0) return Matrix6<double>::Zero();
    return J_common_.middleRows<6>(row);
  }

  /// The covariances of all nodes.
  [[nodiscard]] std::vector<Matrix6<double>> marginals() const {
    std::vector<Matrix6<double>> result(first_variable_.size(), Matrix6<double>::Zero());
    if (variables_ == 0) return result;
    const SelectedInverse inverse(factor_);
    for (std::size_t node = 0; node < result.size(); ++node) {
      const int first = first_variable_[node];
      if (first < 0) continue;
      for (int i = 0; i < 6; ++i) {
        for (int j = 0; j < 6; ++j) result[node](i, j) = inverse(first + i, first + j).value();
      }
    }
    return result;
  }

 private:
  static constexpr int kFixed = -1;
  static constexpr int kUnknown = -2;

  /// Columns first to first + 5 of the inverse of the information.
  [[nodiscard]] MatrixX6 columns_of_inverse(int first) const {
    MatrixX6 unit = MatrixX6::Zero(variables_, 6);
    unit.middleRows<6>(first).setIdentity();
    return factor_.solve(unit);
  }

  void decompose(ceres::Problem& problem, const std::vector<double*>& movable,
                 const std::vector<PoseGraphEdge>& odometry) {
    ceres::Problem::EvaluateOptions options;
    options.parameter_blocks = movable;
    ceres::CRSMatrix J;
    const bool evaluated = problem.Evaluate(options, nullptr, nullptr, nullptr, &J);
    const Eigen::Map<const RowMajor> jacobian(J.num_rows, J.num_cols, static_cast<int>(J.values.size()),
                                              J.rows.data(), J.cols.data(), J.values.data());
    factor_.compute(SparseMatrix(jacobian.transpose() * jacobian));
    const bool definite = evaluated && factor_.info() == Eigen::Success && factor_.vectorD().allFinite() &&
                          (factor_.vectorD().array() > std::numeric_limits<double>::min()).all();
    if (!definite) {
      std::replace_if(
          first_variable_.begin(), first_variable_.end(), [](int v) { return v >= 0; }, kUnknown);
      variables_ = 0;
      return;
    }
    J_common_ = factor_.solve(jacobian.transpose() * common_residuals(jacobian, odometry));
  }

  /// d residuals / d (factors of the common error). The residuals of the odometry come first; those of
  /// loops have no part in it. The error of an edge acts on its residual like a perturbation of its second
  /// node.
  [[nodiscard]] MatrixX6 common_residuals(const Eigen::Map<const RowMajor>& jacobian,
                                          const std::vector<PoseGraphEdge>& odometry) const {
    MatrixX6 result = MatrixX6::Zero(jacobian.rows(), 6);
    for (std::size_t k = 0; k < odometry.size(); ++k) {
      const auto& [from, to, T_from_to, measured, tilt] = odometry[k];
      const int column = first_variable_[to];
      if (column < 0 || !measured) continue;
      const auto row = static_cast<Eigen::Index>(6 * k);
      const Matrix6<double> J_to = jacobian.block(row, column, 6, 6).toDense();
      if (tilt) {
        result.middleRows<6>(row) = J_to * common_error_per_rad(T_from_to, *tilt);
      } else {
        result.middleRows<6>(row) = J_to * common_error_per_rad(T_from_to).asDiagonal();
      }
    }
    return result;
  }

  std::vector<int> first_variable_;  // of each node
  int variables_ = 0;
  SparseFactor factor_;
  MatrixX6 J_common_;  // of all variables
};

std::vector<LinkedPose> marginals(const PoseGraph& graph, const PoseGraphSettings& settings) {
  const GraphInformation information(graph, settings);
  for (std::size_t node = 0; node < graph.poses.size(); ++node) {
    if (!information.knows(node)) return {};
  }
  const auto covariances = information.marginals();
  std::vector<LinkedPose> result;
  for (std::size_t node = 0; node < graph.poses.size(); ++node) {
    result.push_back({{graph.poses[node], covariances[node]}, information.J_common(node)});
    if (!covariances[node].allFinite() || !result.back().J_common.allFinite()) return {};
  }
  return result;
}

struct LoopPrediction::State {
  std::vector<Pose> poses;
  GraphInformation information;
  double common_error_rad;
};

LoopPrediction::LoopPrediction(const PoseGraph& graph, const PoseGraphSettings& settings)
    : state_(new State{graph.poses, GraphInformation(graph, settings), graph.common_error_rad}) {}

bool LoopPrediction::knows(std::size_t from, std::size_t to) const {
  return state_->information.knows(from) && state_->information.knows(to);
}

PoseGaussian LoopPrediction::relative_pose(std::size_t from, std::size_t to) const {
  const auto& [poses, information, common_error_rad] = *state_;
  if (!knows(from, to)) {
    throw std::runtime_error(fmt::format(
        "nodes {} and {} of the pose graph are not connected, or their covariances cannot be computed", from,
        to));
  }
  const auto covariance = information.covariances(from, to);
  const PoseGaussian relative = antipode::relative_pose_first_order<double>(
      {poses[from], covariance.first}, {poses[to], covariance.second}, covariance.first_second);
  const Matrix6<double> J_common =
      information.J_common(to) - relative.pose.inverse().adjoint() * information.J_common(from);
  return LinkedPose{relative, J_common}.with_common_error(common_error_rad);
}

double LoopPrediction::mahalanobis_squared(const PoseGraphEdge& edge, double scale,
                                           const Matrix6<double>& allowance) const {
  const PoseGaussian predicted = relative_pose(edge.from, edge.to);
  const Vector6<double> e = edge.T_from_to.pose.boxminus(predicted.pose);
  const Matrix6<double> S = scale * (predicted.covariance + edge.T_from_to.covariance) + allowance;
  return stereo_slam::mahalanobis_squared(e, S);
}

}  // namespace stereo_slam
