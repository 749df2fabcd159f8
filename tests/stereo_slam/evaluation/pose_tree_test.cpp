// SPDX-License-Identifier: MIT
#include "stereo_slam/evaluation/pose_tree.hpp"

#include <random>

#include "support/catch.hpp"

using namespace stereo_slam;

namespace {

/// A walk in a room, with stops.
std::vector<Eigen::Isometry3d> walk(std::size_t count, double step_m, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::vector<Eigen::Isometry3d> poses;
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  for (std::size_t i = 0; i < count; ++i) {
    poses.push_back(T);
    if (i % 50 < 20) continue;
    T = T * Eigen::Translation3d(step_m * normal(random), step_m * normal(random), step_m * normal(random)) *
        Eigen::AngleAxisd(0.1 * normal(random), Eigen::Vector3d::UnitY());
  }
  return poses;
}

}  // namespace

TEST_CASE("The tree finds what a search through all poses finds", "[pose_tree]") {
  const Nearness nearness{.max_distance_m = 1.0, .max_angle_rad = 0.4};
  for (const std::size_t count : {0, 1, 7, 8, 9, 300}) {
    const auto poses = walk(count, 0.3, static_cast<unsigned>(count));
    const PoseTree tree(poses, nearness);
    for (std::size_t i = 0; i < count; ++i) {
      std::optional<std::size_t> last_far;
      bool any_near = false;
      for (std::size_t j = 0; j < i; ++j) {
        CHECK(tree.any_near(poses[i], j) == any_near);
        if (is_near(poses[j], poses[i], nearness)) {
          any_near = true;
        } else {
          last_far = j;
        }
        CHECK(tree.last_far(poses[i], j + 1) == last_far);
      }
    }
  }
}
