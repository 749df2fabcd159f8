// SPDX-License-Identifier: MIT
#include "stereo_slam/slam/bridging.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace stereo_slam {
namespace {

/// The share of each frame from `first` up to `end` in the error at `end`. The standard deviation of the
/// predicted position grows from frame to frame, and the error with it; at `end` it has grown as in the step
/// before.
[[nodiscard]] std::vector<double> shares(const std::vector<PoseGaussian>& poses, std::size_t first,
                                         std::size_t end) {
  const auto variance_m2 = [&](std::size_t i) {
    return poses[i].covariance.bottomRightCorner<3, 3>().trace();
  };
  std::vector<double> sigma_m{0.0};
  for (std::size_t i = first; i < end; ++i)
    sigma_m.push_back(std::sqrt(std::max(0.0, variance_m2(i) - variance_m2(first - 1))));
  const double at_end = 2.0 * sigma_m.back() - sigma_m[sigma_m.size() - 2];
  std::vector<double> result;
  for (std::size_t i = 1; i < sigma_m.size(); ++i) {
    const double equal = static_cast<double>(i) / static_cast<double>(sigma_m.size());
    result.push_back(at_end > 0.0 ? std::min(1.0, sigma_m[i] / at_end) : equal);
  }
  return result;
}

/// Bridges the frames from `first` up to `end`, which is the next tracked frame.
void bridge(std::vector<PoseGaussian>& poses, std::size_t first, std::size_t end) {
  const Pose last_step = poses[end - 2].pose.inverse() * poses[end - 1].pose;
  const Vector6<double> error = ((poses[end - 1].pose * last_step).inverse() * poses[end].pose).log();
  const std::vector<double> share_of = shares(poses, first, end);
  for (std::size_t i = first; i < end; ++i) {
    const double share = share_of[i - first];
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
