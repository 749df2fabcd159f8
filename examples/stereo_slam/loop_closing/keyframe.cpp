// SPDX-License-Identifier: MIT
#include "stereo_slam/loop_closing/keyframe.hpp"

#include <algorithm>
#include <iterator>

#include "stereo_slam/frontend/orb_descriptors.hpp"

namespace stereo_slam {

std::vector<KeyframePoint> keyframe_points(const StereoPoints& points,
                                           const std::vector<std::uint32_t>& landmarks) {
  std::vector<KeyframePoint> result;
  for (std::size_t i = 0; i < points.measured.size(); ++i) {
    KeyframePoint point{.z = points.measured[i].z.cast<float>()};
    if (!points.descriptors.empty()) point.descriptor = points.descriptors[i];
    if (!landmarks.empty()) point.landmark = landmarks[i];
    result.push_back(point);
  }
  return result;
}

void describe(std::vector<KeyframePoint>& points, const cv::Mat& left, const LensResidual& lens) {
  std::vector<Vector2<double>> px;
  px.reserve(points.size());
  for (const auto& point : points) px.push_back(lens.in_image(measurement(point).head<2>()));
  const auto descriptors = describe_points(left, px);
  for (std::size_t i = 0; i < points.size(); ++i) points[i].descriptor = descriptors[i];
}

std::size_t shared_landmarks(const Keyframe& a, const Keyframe& b) {
  const auto ids_of = [](const Keyframe& keyframe) {
    std::vector<std::uint32_t> result;
    for (const auto& point : keyframe.points) {
      if (point.landmark > 0) result.push_back(point.landmark);
    }
    std::sort(result.begin(), result.end());
    return result;
  };
  std::vector<std::uint32_t> shared;
  std::ranges::set_intersection(ids_of(a), ids_of(b), std::back_inserter(shared));
  return shared.size();
}

}  // namespace stereo_slam
