// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/settings/settings.hpp"

namespace stereo_slam {

/// Measured pose of one node relative to another.
struct PoseGraphEdge {
  std::size_t from = 0;
  std::size_t to = 0;
  PoseGaussian T_from_to;
};

/// Poses, and what is known of them relative to each other. The first poses are the gauge: they stay.
struct PoseGraph {
  std::vector<Pose> poses;              ///< T_world_node
  std::vector<PoseGraphEdge> odometry;  ///< believed
  std::vector<PoseGraphEdge> loops;     ///< may be wrong
  std::size_t gauge = 1;                ///< how many poses stay, at least one
};

struct PoseGraphResult {
  std::vector<Pose> poses;
  std::vector<double> loop_weights;  ///< of the loops' information, 0..1: small ones were taken for wrong
  bool converged = false;
  int iterations = 0;
  double initial_cost = 0.0;  ///< half the sum of squares, every loop at full weight
  double final_cost = 0.0;    ///< half the robust sum
};

/// Poses that fit the edges best, each weighted by its full 6 x 6 information.
///
/// Loops have a redescending loss (dynamic covariance scaling) with parameter `loop_scale`. From poses far
/// away it would take every loop for wrong, so it is annealed: the loss starts as good as quadratic and
/// narrows while the poses settle. What single loops cannot tell, whether they or the odometry err, is asked
/// with mahalanobis_squared() before they become edges. Source: P. Agarwal et al., "Robust Map Optimization
/// Using Dynamic Covariance Scaling", ICRA 2013, for the loss; H. Yang et al., "Graduated Non-Convexity for
/// Robust Spatial Perception", RA-L 2020, for the annealing.
///
/// Deterministic: one thread, the same input gives the same bits. Throws std::invalid_argument for edges
/// between nodes that do not exist and covariances that are not positive definite.
[[nodiscard]] PoseGraphResult optimize(const PoseGraph& graph, const PoseGraphSettings& settings);

/// Covariances of the right perturbations of some poses, given the gauge; zero for the gauge itself. The
/// graph is taken at its poses, which should be the optimum. Empty if they do not exist: a node without a way
/// to the gauge.
[[nodiscard]] std::vector<Matrix6<double>> marginal_covariances(const PoseGraph& graph,
                                                                std::span<const std::size_t> nodes,
                                                                const PoseGraphSettings& settings);

/// The density of a relative pose that the graph predicts; its covariance knows how much of the errors both
/// nodes share. Throws std::runtime_error where marginal_covariances() is empty.
[[nodiscard]] PoseGaussian predicted_relative_pose(const PoseGraph& graph, std::size_t from, std::size_t to,
                                                   const PoseGraphSettings& settings);

/// How much worse than the covariances say things may be: they are multiplied, then added to.
struct CovarianceInflation {
  double scale = 1.0;
  Matrix6<double> covariance = Matrix6<double>::Zero();
};

/// Squared Mahalanobis distance by which a new edge contradicts the graph, six degrees of freedom: without an
/// inflation what adding it would add to the sum of squares, to first order.
[[nodiscard]] double mahalanobis_squared(const PoseGraph& graph, const PoseGraphEdge& edge,
                                         const CovarianceInflation& inflation,
                                         const PoseGraphSettings& settings);

}  // namespace stereo_slam
