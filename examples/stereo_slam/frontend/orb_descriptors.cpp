// SPDX-License-Identifier: MIT
#include "stereo_slam/frontend/orb_descriptors.hpp"

#include <cmath>
#include <cstddef>
#include <cstring>

#include <opencv2/features2d.hpp>

#include "stereo_slam/frontend/features.hpp"

namespace stereo_slam {
namespace {

constexpr int kOrbPatch_px = 31;

/// Direction from a pixel to the centroid of the grey values around it, degrees in [0, 360): the orientation
/// of ORB.
[[nodiscard]] float orientation(const cv::Mat& image, cv::Point centre) {
  constexpr int kRadius_px = kOrbPatch_px / 2;
  int along_x = 0;
  int along_y = 0;
  for (int dy = -kRadius_px; dy <= kRadius_px; ++dy) {
    const int half_width =
        static_cast<int>(std::sqrt(static_cast<double>(kRadius_px * kRadius_px - dy * dy)));
    const std::uint8_t* line = image.ptr<std::uint8_t>(centre.y + dy) + centre.x;
    int sum = 0;
    for (int dx = -half_width; dx <= half_width; ++dx) {
      along_x += dx * line[dx];
      sum += line[dx];
    }
    along_y += dy * sum;
  }
  return cv::fastAtan2(static_cast<float>(along_y), static_cast<float>(along_x));
}

}  // namespace

std::vector<Descriptor> describe_points(const cv::Mat& image, const std::vector<Vector2<double>>& points_px) {
  std::vector<Descriptor> descriptors(points_px.size());
  std::vector<cv::KeyPoint> keypoints;
  for (std::size_t i = 0; i < points_px.size(); ++i) {
    const cv::Point at(static_cast<int>(std::lround(points_px[i].x())),
                       static_cast<int>(std::lround(points_px[i].y())));
    const bool inside = at.x >= kDescriptorReach_px && at.y >= kDescriptorReach_px &&
                        at.x < image.cols - kDescriptorReach_px && at.y < image.rows - kDescriptorReach_px;
    if (!inside) continue;
    keypoints.emplace_back(static_cast<float>(at.x), static_cast<float>(at.y),
                           static_cast<float>(kOrbPatch_px), orientation(image, at), /*response=*/0.0F,
                           /*octave=*/0, /*class_id=*/static_cast<int>(i));
  }
  if (keypoints.empty()) return descriptors;
  const auto orb = cv::ORB::create(static_cast<int>(keypoints.size()), /*scaleFactor=*/2.0F, /*nlevels=*/1,
                                   /*edgeThreshold=*/kDescriptorReach_px, /*firstLevel=*/0, /*WTA_K=*/2,
                                   cv::ORB::FAST_SCORE, kOrbPatch_px);
  cv::Mat bits;
  orb->compute(image, keypoints, bits);
  for (std::size_t k = 0; k < keypoints.size(); ++k) {
    auto& descriptor = descriptors[static_cast<std::size_t>(keypoints[k].class_id)];
    std::memcpy(descriptor.data(), bits.ptr(static_cast<int>(k)), descriptor.size());
  }
  return descriptors;
}

}  // namespace stereo_slam
