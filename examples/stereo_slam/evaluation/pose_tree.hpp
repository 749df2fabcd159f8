// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace stereo_slam {

/// Largest distance and angle between two poses that count as near.
struct Nearness {
  double max_distance_m = 0.0;
  double max_angle_rad = 0.0;
};

[[nodiscard]] bool is_near(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b, const Nearness& nearness);

/// A binary tree over the poses of a path, in their order. Each node bounds its poses by a ball of positions
/// and a ball of rotation matrices, so that a search need not visit the poses of a node that are all near or
/// all far.
class PoseTree {
 public:
  PoseTree(std::vector<Eigen::Isometry3d> poses, const Nearness& nearness);

  /// Index of the last pose before index `end` that is not near `pose`.
  [[nodiscard]] std::optional<std::size_t> last_far(const Eigen::Isometry3d& pose, std::size_t end) const;

  /// Whether any pose before index `end` is near `pose`.
  [[nodiscard]] bool any_near(const Eigen::Isometry3d& pose, std::size_t end) const;

 private:
  /// The poses from `begin` to `end`; the children of node i are 2i + 1 and 2i + 2.
  struct Node {
    std::size_t begin = 0;
    std::size_t end = 0;
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Zero();
    double radius_m = 0.0;
    double rotation_radius = 0.0;  ///< Frobenius norm
  };
  enum class Relation { kAllNear, kAllFar, kMixed };

  void build(std::size_t node, std::size_t begin, std::size_t end);
  [[nodiscard]] Relation relation(const Node& node, const Eigen::Isometry3d& pose) const;
  [[nodiscard]] std::optional<std::size_t> last_far(std::size_t node, const Eigen::Isometry3d& pose,
                                                    std::size_t end) const;
  [[nodiscard]] bool any_near(std::size_t node, const Eigen::Isometry3d& pose, std::size_t end) const;

  std::vector<Eigen::Isometry3d> poses_;
  Nearness nearness_;
  std::vector<Node> nodes_;
};

}  // namespace stereo_slam
