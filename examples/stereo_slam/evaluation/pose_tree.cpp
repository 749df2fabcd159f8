// SPDX-License-Identifier: MIT
#include "stereo_slam/evaluation/pose_tree.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace stereo_slam {
namespace {

constexpr std::size_t kLeaf = 8;

/// tr(A' B), which is 1 + 2 cos of the angle between two rotations.
[[nodiscard]] double trace_of_product(const Eigen::Matrix3d& A, const Eigen::Matrix3d& B) {
  return A.cwiseProduct(B).sum();
}

}  // namespace

bool is_near(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b, const Nearness& nearness) {
  if ((a.translation() - b.translation()).squaredNorm() > nearness.max_distance_m * nearness.max_distance_m)
    return false;
  return 0.5 * (trace_of_product(a.linear(), b.linear()) - 1.0) >= std::cos(nearness.max_angle_rad);
}

PoseTree::PoseTree(std::vector<Eigen::Isometry3d> poses, const Nearness& nearness)
    : poses_(std::move(poses)), nearness_(nearness) {
  if (poses_.empty()) return;
  std::size_t leaves = 1;
  while (leaves * kLeaf < poses_.size()) leaves *= 2;
  nodes_.resize(2 * leaves - 1);
  build(0, 0, poses_.size());
}

void PoseTree::build(std::size_t node, std::size_t begin, std::size_t end) {
  Node& n = nodes_[node];
  n.begin = begin;
  n.end = end;
  for (std::size_t i = begin; i < end; ++i) {
    n.position += poses_[i].translation() / static_cast<double>(end - begin);
    n.rotation += poses_[i].linear() / static_cast<double>(end - begin);
  }
  for (std::size_t i = begin; i < end; ++i) {
    n.radius_m = std::max(n.radius_m, (poses_[i].translation() - n.position).norm());
    n.rotation_radius = std::max(n.rotation_radius, (poses_[i].linear() - n.rotation).norm());
  }
  if (2 * node + 2 >= nodes_.size()) return;
  const std::size_t middle = begin + (end - begin) / 2;
  build(2 * node + 1, begin, middle);
  build(2 * node + 2, middle, end);
}

PoseTree::Relation PoseTree::relation(const Node& node, const Eigen::Isometry3d& pose) const {
  constexpr double kRounding = 1e-9;  // margin: a node on the border is searched
  const double distance_m = (pose.translation() - node.position).norm();
  const double margin_m = node.radius_m + kRounding * (1.0 + distance_m);
  const double trace = trace_of_product(pose.linear(), node.rotation);
  const double margin = pose.linear().norm() * node.rotation_radius + kRounding;
  const double least_trace = 1.0 + 2.0 * std::cos(nearness_.max_angle_rad);
  if (distance_m - margin_m > nearness_.max_distance_m || trace + margin < least_trace)
    return Relation::kAllFar;
  if (distance_m + margin_m < nearness_.max_distance_m && trace - margin > least_trace)
    return Relation::kAllNear;
  return Relation::kMixed;
}

std::optional<std::size_t> PoseTree::last_far(const Eigen::Isometry3d& pose, std::size_t end) const {
  return nodes_.empty() ? std::nullopt : last_far(0, pose, end);
}

std::optional<std::size_t> PoseTree::last_far(std::size_t node, const Eigen::Isometry3d& pose,
                                              std::size_t end) const {
  const Node& n = nodes_[node];
  end = std::min(end, n.end);
  if (n.begin >= end) return std::nullopt;
  const Relation relation = this->relation(n, pose);
  if (relation == Relation::kAllNear) return std::nullopt;
  if (relation == Relation::kAllFar) return end - 1;
  if (2 * node + 2 < nodes_.size()) {
    const auto later = last_far(2 * node + 2, pose, end);
    return later ? later : last_far(2 * node + 1, pose, end);
  }
  for (std::size_t i = end; i-- > n.begin;) {
    if (!is_near(poses_[i], pose, nearness_)) return i;
  }
  return std::nullopt;
}

bool PoseTree::any_near(const Eigen::Isometry3d& pose, std::size_t end) const {
  return !nodes_.empty() && any_near(0, pose, end);
}

bool PoseTree::any_near(std::size_t node, const Eigen::Isometry3d& pose, std::size_t end) const {
  const Node& n = nodes_[node];
  end = std::min(end, n.end);
  if (n.begin >= end) return false;
  const Relation relation = this->relation(n, pose);
  if (relation != Relation::kMixed) return relation == Relation::kAllNear;
  if (2 * node + 2 < nodes_.size())
    return any_near(2 * node + 1, pose, end) || any_near(2 * node + 2, pose, end);
  return std::any_of(poses_.begin() + static_cast<std::ptrdiff_t>(n.begin),
                     poses_.begin() + static_cast<std::ptrdiff_t>(end),
                     [&](const auto& other) { return is_near(other, pose, nearness_); });
}

}  // namespace stereo_slam
