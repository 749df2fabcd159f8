// SPDX-License-Identifier: MIT
#include "stereo_slam/tracking/pose_likelihood.hpp"

namespace stereo_slam {

PoseLikelihood::PoseLikelihood(const WhitenedMatches& matches, double cap)
    : camera_(matches.camera), cap_(cap), count_(matches.matches.size()), shared_(matches.shared) {
  blocks_.resize((count_ + LandmarkBlock::kLanes - 1) / LandmarkBlock::kLanes);
  for (std::size_t i = 0; i < count_; ++i) {
    const auto& [point, z, U, UV] = matches.matches[i];
    LandmarkBlock& block = blocks_[i / LandmarkBlock::kLanes];
    const std::size_t lane = i % LandmarkBlock::kLanes;
    for (int k = 0; k < 3; ++k) {
      block.point[static_cast<std::size_t>(k)][lane] = point.x[k];
      block.measurement[static_cast<std::size_t>(k)][lane] = z[k];
    }
    block.weight[lane] = point.w;
    std::size_t entry = 0;
    for (int row = 0; row < 3; ++row) {
      for (int column = row; column < 3; ++column) block.whitening[entry++][lane] = U(row, column);
    }
    for (int k = 0; k < 18; ++k) block.correlation[static_cast<std::size_t>(k)][lane] = UV(k / 6, k % 6);
    block.cap[lane] = cap_;
  }
}

double PoseLikelihood::evaluate(const antipode::Vector8<double>& pose) const {
  const Pose T = Pose::unchecked(pose);
  const Matrix3<double> R = T.rotation_matrix().transpose();
  const CameraAtPose view{R, -R * T.translation(), camera_, cap_};
  if (!shared_) return -0.5 * sum_independent_errors(blocks_, view).squared_distance;
  const ErrorSums sums =
      sum_correlated_errors(blocks_, view, shared_->whitening * T.boxminus(shared_->prior));
  return -0.5 * (sums.squared_distance + sums.w.dot(shared_->information * sums.w));
}

}  // namespace stereo_slam
