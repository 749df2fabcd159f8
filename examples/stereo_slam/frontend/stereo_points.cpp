// SPDX-License-Identifier: MIT
#include "stereo_slam/frontend/stereo_points.hpp"

#include <algorithm>

#include "stereo_slam/frontend/corners.hpp"
#include "stereo_slam/frontend/stereo_matching.hpp"

namespace stereo_slam {
namespace {

constexpr int kMinCornersPerCell = 5;

}  // namespace

std::vector<Vector2<double>> find_landmark_corners(const cv::Mat& left,
                                                   const std::vector<Vector2<double>>& present_px,
                                                   const Settings& settings) {
  const auto most = static_cast<std::size_t>(settings.map.max_new_landmarks);
  if (present_px.size() >= most) return {};
  const auto wanted = most - present_px.size();
  const int cell_px = settings.map.cell_px;
  const int cells = ((left.cols + cell_px - 1) / cell_px) * ((left.rows + cell_px - 1) / cell_px);
  const int share = 1 + settings.map.max_new_landmarks / std::max(cells, 1);
  const auto corners = detect_corners(left, present_px, {},
                                      {.cell_px = settings.map.cell_px,
                                       .per_cell = std::max(kMinCornersPerCell, share),
                                       .min_distance_px = settings.odometry.exclusion_px,
                                       .enough = wanted / 2});
  return positions(spread_features(corners, left.size(), settings.map.cell_px, wanted));
}

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

StereoPoints measure_stereo_corners(const StereoView& view, const Settings& settings) {
  const auto corners_px = find_landmark_corners(view.frame.left, {}, settings);
  StereoPoints points;
  for (const auto& match : match_stereo(view, corners_px, settings.stereo)) {
    if (match) points.measured.push_back(*match);
  }
  return points;
}

}  // namespace stereo_slam
