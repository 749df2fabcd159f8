// SPDX-License-Identifier: MIT
#include "stereo_slam/tracking/pose_likelihood.hpp"

#include <algorithm>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "stereo_slam/core/symmetric_solve.hpp"
#include "stereo_slam/local_map/landmark_projection.hpp"

namespace stereo_slam {

PoseLikelihood::PoseLikelihood(std::span<const Match> matches, const MapView& map, double cap)
    : camera_(map.camera), cap_(cap), count_(matches.size()) {
  blocks_.resize((count_ + LandmarkBlock::kLanes - 1) / LandmarkBlock::kLanes);
  for (std::size_t i = 0; i < count_; ++i) {
    const Match& match = matches[i];
    const Landmark& landmark = map.landmarks[match.landmark];
    const HomogeneousPoint point = to_point(landmark, landmark.mean, camera_);
    const Matrix3<double> S = match.predicted.landmark_part + match.R;
    const Matrix3<double> U = S.inverse().llt().matrixU();
    LandmarkBlock& block = blocks_[i / LandmarkBlock::kLanes];
    const std::size_t lane = i % LandmarkBlock::kLanes;
    for (int k = 0; k < 3; ++k) {
      block.point[static_cast<std::size_t>(k)][lane] = point.x[k];
      block.measurement[static_cast<std::size_t>(k)][lane] = match.z[k];
    }
    block.weight[lane] = point.w;
    std::size_t entry = 0;
    for (int row = 0; row < 3; ++row) {
      for (int column = row; column < 3; ++column) block.whitening[entry++][lane] = U(row, column);
    }
    block.cap[lane] = cap_;
  }
}

Matrix3<double> PoseLikelihood::whitening(std::size_t landmark) const {
  const LandmarkBlock& block = blocks_[landmark / LandmarkBlock::kLanes];
  const std::size_t lane = landmark % LandmarkBlock::kLanes;
  Matrix3<double> U = Matrix3<double>::Zero();
  std::size_t entry = 0;
  for (int row = 0; row < 3; ++row) {
    for (int column = row; column < 3; ++column) U(row, column) = block.whitening[entry++][lane];
  }
  return U;
}

PoseLikelihood::PoseLikelihood(std::span<const Match> matches, const MapView& map, double cap,
                               const PoseGaussian& prior)
    : PoseLikelihood(matches, map, cap) {
  const auto is_independent = [&](const Match& match) {
    return map.landmarks[match.landmark].pose_cross_covariance.isZero(0.0);
  };
  if (std::all_of(matches.begin(), matches.end(), is_independent)) return;
  const auto whitening_of_prior = whitening_matrix(prior.covariance);
  if (!whitening_of_prior) return;
  prior_ = prior.pose;
  prior_whitening_ = *whitening_of_prior;
  Matrix6<double> remaining = Matrix6<double>::Identity();
  for (std::size_t i = 0; i < count_; ++i) {
    const Landmark& landmark = map.landmarks[matches[i].landmark];
    const Eigen::Matrix<double, 3, 6> UV = whitening(i) * landmark_jacobian(landmark, prior.pose, camera_) *
                                           landmark.pose_cross_covariance.transpose() *
                                           prior_whitening_.transpose();
    remaining -= UV.transpose() * UV;
    LandmarkBlock& block = blocks_[i / LandmarkBlock::kLanes];
    for (int k = 0; k < 18; ++k) {
      block.correlation[static_cast<std::size_t>(k)][i % LandmarkBlock::kLanes] = UV(k / 6, k % 6);
    }
  }
  // The matrix may not be positive definite by rounding, or because the model is of first order. The safer
  // model is then that of independent errors.
  const auto shared = inverse_of_definite(remaining);
  correlated_ = shared.has_value();
  if (correlated_) shared_ = *shared;
}

double PoseLikelihood::evaluate(const antipode::Vector8<double>& pose) const {
  const Pose T = Pose::unchecked(pose);
  const Matrix3<double> R = T.rotation_matrix().transpose();
  const CameraAtPose view{R, -R * T.translation(), camera_, cap_};
  if (!correlated_) return -0.5 * sum_independent_errors(blocks_, view).squared_distance;
  const ErrorSums sums = sum_correlated_errors(blocks_, view, prior_whitening_ * T.boxminus(prior_));
  return -0.5 * (sums.squared_distance + sums.w.dot(shared_ * sums.w));
}

}  // namespace stereo_slam
