// SPDX-License-Identifier: MIT
#include "stereo_slam/slam/bridging.hpp"

#include <algorithm>
#include <cstddef>

namespace stereo_slam {
namespace {

/// Bridges the frames from `first` up to `end`, which is the next tracked frame.
void bridge(std::vector<PoseGaussian>& poses, std::size_t first, std::size_t end) {
  const Pose last_step = poses[end - 2].pose.inverse() * poses[end - 1].pose;
  const Vector6<double> error = ((poses[end - 1].pose * last_step).inverse() * poses[end].pose).log();
  for (std::size_t i = first; i < end; ++i) {
    const double share = static_cast<double>(i + 1 - first) / static_cast<double>(end + 1 - first);
    poses[i].pose = (poses[i].pose * Pose::exp(share * error)).renormalized();
    poses[i].covariance = (1.0 - share) * poses[i].covariance + share * poses[end].covariance;
  }
}

}  // namespace

void bridge_untracked(std::vector<PoseGaussian>& T_world_camera, const std::vector<bool>& tracked) {
  for (std::size_t i = 1; i < tracked.size(); ++i) {
    if (tracked[i] || !tracked[i - 1]) continue;
    const auto next = std::find(tracked.begin() + static_cast<std::ptrdiff_t>(i), tracked.end(), true);
    if (next != tracked.end()) bridge(T_world_camera, i, static_cast<std::size_t>(next - tracked.begin()));
  }
}

}  // namespace stereo_slam
