// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "stereo_slam/io/trajectory_io.hpp"

/// Which poses of an estimate and of the ground truth belong to the same instant.
namespace stereo_slam {

using FramePairs = std::vector<std::pair<std::size_t, std::size_t>>;

/// Indices (truth, estimate) of poses whose stamps differ by at most `max_difference_ns`. Each pose of the
/// shorter list is matched with the nearest of the longer one, as by evo; two may have the same.
[[nodiscard]] FramePairs associate_by_stamp(std::span<const std::int64_t> truth_ns,
                                            std::span<const std::int64_t> estimate_ns,
                                            std::int64_t max_difference_ns);

/// Indices (truth, estimate) of matched poses: by stamp when both trajectories have stamps, by the number of
/// the frame when neither has. Throws std::runtime_error, with the ranges of the stamps, when only one has
/// stamps, and when fewer than three poses match.
[[nodiscard]] FramePairs match_poses(const Trajectory& truth, const Trajectory& estimate,
                                     double max_difference_s = 0.01);

/// Poses of both trajectories at the same instants.
struct PosePairs {
  std::vector<Eigen::Isometry3d> truth;
  std::vector<Eigen::Isometry3d> estimate;
};

[[nodiscard]] PosePairs poses_of_pairs(const Trajectory& truth, const Trajectory& estimate,
                                       const FramePairs& pairs);

/// The first and the last stamps, or frames, of both trajectories, and how far apart they are if they do not
/// overlap.
[[nodiscard]] std::string describe_ranges(const Trajectory& truth, const Trajectory& estimate);

}  // namespace stereo_slam
