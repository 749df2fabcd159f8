// SPDX-License-Identifier: MIT
#include "stereo_slam/frontend/stereo_points.hpp"

#include "stereo_slam/frontend/stereo_matching.hpp"

namespace stereo_slam {

StereoPoints measure_stereo_points(const StereoView& view, const std::vector<Feature>& features,
                                   const std::vector<Vector2<double>>& reserved_px,
                                   const Settings& settings) {
  const cv::Size image = view.frame.left.size();
  const auto spread =
      spread_features(exclude_features(features, reserved_px, image, settings.odometry.exclusion_px), image,
                      settings.map.cell_px, static_cast<std::size_t>(settings.map.max_new_landmarks));
  const auto matches = match_stereo(view, positions(spread), settings.stereo);
  StereoPoints points;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (!matches[i]) continue;
    points.measured.push_back(*matches[i]);
    points.descriptors.push_back(spread[i].descriptor);
  }
  return points;
}

}  // namespace stereo_slam
