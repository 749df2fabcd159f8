// SPDX-License-Identifier: MIT
#include "stereo_slam/slam/tracked_pose.hpp"

#include <cstddef>
#include <utility>

namespace stereo_slam {

TrackedPose TrackedPose::updated(const PoseGaussian& prior, OdometryResult odometry,
                                 std::vector<Match> matches, const PoseUpdate& update) {
  PoseBasis basis = PoseBasis::kNothing;
  if (odometry.valid) basis = PoseBasis::kOdometry;
  if (update.converged) basis = PoseBasis::kLandmarks;
  return {.prior = prior,
          .posterior = update.posterior,
          .basis = basis,
          .odometry = std::move(odometry),
          .matches = std::move(matches),
          .nis = update.nis,
          .nis_dof = update.nis_dof,
          .variance_ratio = update.variance_ratio};
}

bool TrackedPose::has_few_landmarks() const noexcept {
  constexpr std::size_t kFewMatches = 15;
  return basis == PoseBasis::kLandmarks && matches.size() < kFewMatches;
}

void TrackedPose::report(FrameResult& result) const {
  result.odometry = odometry.T_previous_current;
  result.matches = static_cast<int>(matches.size());
  result.nis = nis;
  result.nis_dof = nis_dof;
}

}  // namespace stereo_slam
