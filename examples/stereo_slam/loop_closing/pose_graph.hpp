// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "stereo_slam/core/pose_estimate.hpp"
#include "stereo_slam/core/tilt_measurement.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/settings/settings.hpp"

namespace stereo_slam {

/// Measured pose of one node relative to another.
struct PoseGraphEdge {
  std::size_t from = 0;
  std::size_t to = 0;
  PoseGaussian T_from_to;
  bool measured = true;  ///< false: T_from_to is a guess, which has no part in the common error
  std::optional<TiltMeasurement> tilt{};  ///< of the odometry: that of `to`, relative to PoseGraph::first
};

/// Poses and relative measurements between them. The first poses are fixed: they are the gauge.
struct PoseGraph {
  std::vector<Pose> poses;              ///< T_world_node
  std::vector<PoseGraphEdge> odometry;  ///< without a robust loss
  std::vector<PoseGraphEdge> loops;     ///< may be outliers: they get a robust loss
  std::size_t first = 0;                ///< first keyframe of the run, to which tilts are relative
  std::size_t gauge = 1;                ///< number of fixed poses, at least one
  double common_error_rad = 0.0;        ///< standard deviation of the odometry's common error (LinkedPose)
};

struct PoseGraphResult {
  std::vector<Pose> poses;
  std::vector<double> loop_weights;  ///< factors on the loops' information, 0..1; outliers get small ones
  bool converged = false;
  double final_cost = 0.0;  ///< half the robust sum of squares
};

/// Poses that fit the edges best, each weighted by its full 6 x 6 information.
///
/// Loops have a redescending loss (dynamic covariance scaling) with parameter `loop_scale`. From a bad start
/// every loop would look like an outlier; the loss is therefore annealed from nearly quadratic to
/// `loop_scale` while the poses converge. A single false loop cannot be told from odometry drift here:
/// mahalanobis_squared() gates loops before they become edges. Source: P. Agarwal et al., "Robust Map
/// Optimization Using Dynamic Covariance Scaling", ICRA 2013, for the loss; H. Yang et al., "Graduated
/// Non-Convexity for Robust Spatial Perception", RA-L 2020, for the annealing.
///
/// Deterministic: one thread, the same input gives the same bits. Throws std::invalid_argument for edges
/// between nodes that do not exist and covariances that are not positive definite.
[[nodiscard]] PoseGraphResult optimize(const PoseGraph& graph, const PoseGraphSettings& settings);

/// Poses of the graph with the covariances of their right perturbations, given the gauge, and with their
/// sensitivities to the common error of the odometry. Loops reduce both; both are zero for the fixed poses.
/// The graph is linearised at its poses, which should be the optimum. Empty if some node is not connected to
/// the gauge, or if the covariances cannot be computed. The same input gives the same bits.
[[nodiscard]] std::vector<LinkedPose> marginals(const PoseGraph& graph, const PoseGraphSettings& settings);

/// What a graph, linearised at its poses, predicts about loops that it does not contain. The graph is
/// decomposed once, in the constructor.
class LoopPrediction {
 public:
  LoopPrediction(const PoseGraph& graph, const PoseGraphSettings& settings);

  /// The relative pose of two nodes; its covariance contains the common error of the odometry, and accounts
  /// for the errors that both nodes share. Throws std::runtime_error unless knows().
  [[nodiscard]] PoseGaussian relative_pose(std::size_t from, std::size_t to) const;

  /// Whether the graph predicts the relative pose of two nodes: both are connected to the gauge, and the
  /// covariances can be computed. They cannot where parts of the graph are held by guesses alone.
  [[nodiscard]] bool knows(std::size_t from, std::size_t to) const;

  /// Squared Mahalanobis distance of an edge from the predicted relative pose, six degrees of freedom. For
  /// errors that its covariance P does not contain, P becomes scale * P + allowance. Without them it is, to
  /// first order, what the edge would add to the sum of squares. Throws as relative_pose().
  [[nodiscard]] double mahalanobis_squared(const PoseGraphEdge& edge, double scale = 1.0,
                                           const Matrix6<double>& allowance = Matrix6<double>::Zero()) const;

 private:
  struct State;
  std::shared_ptr<const State> state_;
};

}  // namespace stereo_slam
