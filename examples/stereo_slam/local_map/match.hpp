// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/local_map/landmark.hpp"

namespace stereo_slam {

/// Landmark found in the current frame.
struct Match {
  std::size_t landmark = 0;                           ///< index in the list of landmarks
  StereoPoint z = StereoPoint::Zero();                ///< its measurement
  Vector2<double> left_px = Vector2<double>::Zero();  ///< where the left image shows it
  Matrix3<double> R = Matrix3<double>::Zero();        ///< covariance of z, px^2
  PredictedLandmark predicted;                        ///< its prediction
  std::optional<std::size_t> left_feature{};  ///< index in the left image's features, if matched with one
  double row_error_px = 0.0;                  ///< left minus right row, corrected; 0 without a right one
};

/// Positions of the landmarks in the left image, px.
[[nodiscard]] inline std::vector<Vector2<double>> positions(const std::vector<Match>& matches) {
  std::vector<Vector2<double>> result;
  result.reserve(matches.size());
  for (const auto& match : matches) result.push_back(match.left_px);
  return result;
}

}  // namespace stereo_slam
