// SPDX-License-Identifier: MIT
// Pose graphs with edges that nobody measured.
#include "stereo_slam/loop_closing/pose_graph.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "fuzz/fuzz_target.hpp"
#include "fuzz/hostile_input.hpp"

namespace antipode::fuzz {
namespace {

using stereo_slam::PoseGraph;
using stereo_slam::PoseGraphEdge;

[[nodiscard]] stereo_slam::Pose near_pose(HostileInput& input) {
  Vector6<double> twist = input.ordinary_numbers<6>();
  if (input.choice(8) == 0) twist.tail<3>() *= input.scale();
  return stereo_slam::Pose::exp(twist);
}

[[nodiscard]] PoseGraphEdge edge(HostileInput& input, std::size_t from, std::size_t to) {
  return {from, to, {near_pose(input), input.covariance<6>()}, to % 4 != 3};
}

void pose_graph(Bytes bytes) {
  HostileInput input(bytes);
  const stereo_slam::PoseGraphSettings settings{};
  allow_refusal([&] {
    PoseGraph graph;
    const std::size_t nodes = 1 + input.choice(6);
    for (std::size_t i = 0; i < nodes; ++i) graph.poses.push_back(near_pose(input));
    for (std::size_t i = 1; i < nodes; ++i) {
      if (input.choice(8) > 0) graph.odometry.push_back(edge(input, i - 1, i));
    }
    for (unsigned count = input.choice(4); count > 0; --count) {
      const unsigned from = input.choice(7), to = input.choice(7);
      graph.loops.push_back(edge(input, from, to));
    }
    const auto result = optimize(graph, settings);
    for (const auto& pose : result.poses) require(pose.coeffs().allFinite(), "a pose is not finite");
    require(std::all_of(result.loop_weights.begin(), result.loop_weights.end(),
                        [](double w) { return w >= 0.0 && w <= 1.0; }),
            "a weight is not from 0 to 1");
    require(!result.converged || std::isfinite(result.final_cost), "converged to a cost that is no number");
    graph.poses = result.poses;
    for (const auto& [estimate, J_common] : marginals(graph, settings)) {
      require(estimate.covariance.allFinite(), "a covariance is not finite");
      require(J_common.allFinite(), "the effect of the common error is not finite");
    }
  });
}

}  // namespace

std::vector<Target> pose_graph_targets() { return {{"pose_graph", pose_graph}}; }

}  // namespace antipode::fuzz
