// SPDX-License-Identifier: MIT
#include "stereo_slam/tracking/whitened_matches.hpp"

#include <algorithm>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "stereo_slam/core/symmetric_solve.hpp"
#include "stereo_slam/local_map/landmark.hpp"

namespace stereo_slam {

WhitenedMatches whiten(std::span<const Match> matches, const MapView& map) {
  WhitenedMatches result{map.camera, {}};
  result.matches.reserve(matches.size());
  for (const Match& match : matches) {
    const Landmark& landmark = map.landmarks[match.landmark];
    const Matrix3<double> S = match.predicted.landmark_part + match.R;
    result.matches.push_back(
        {to_point(landmark, landmark.mean, map.camera), match.z, S.inverse().llt().matrixU()});
  }
  return result;
}

WhitenedMatches whiten(std::span<const Match> matches, const MapView& map, const PoseGaussian& prior) {
  WhitenedMatches result = whiten(matches, map);
  const auto is_independent = [&](const Match& match) {
    return map.landmarks[match.landmark].pose_cross_covariance.isZero(0.0);
  };
  if (std::all_of(matches.begin(), matches.end(), is_independent)) return result;
  const auto whitening = whitening_matrix(prior.covariance);
  if (!whitening) return result;
  Matrix6<double> remaining = Matrix6<double>::Identity();
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const Landmark& landmark = map.landmarks[matches[i].landmark];
    WhitenedMatch& match = result.matches[i];
    match.UV = match.U * landmark_jacobian(landmark, prior.pose, map.camera) *
               landmark.pose_cross_covariance.transpose() * whitening->transpose();
    remaining -= match.UV.transpose() * match.UV;
  }
  // The matrix may not be positive definite by rounding, or because the model is of first order. The safer
  // model is then that of independent errors.
  if (const auto information = inverse_of_definite(remaining))
    result.shared = {prior.pose, *whitening, *information};
  return result;
}

}  // namespace stereo_slam
