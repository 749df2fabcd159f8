// SPDX-License-Identifier: MIT
#include "stereo_slam/frontend/orb_descriptors.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include <opencv2/features2d.hpp>

#include "stereo_slam/frontend/features.hpp"

namespace stereo_slam {
namespace {

constexpr int kOrbPatch_px = 31;

/// Weights of a row of the disc in which ORB measures the orientation, from dx = -kDiscRadius_px on: dx and 1
/// in the disc, zeros beside it. All rows have the same length, a multiple of sixteen, for the compiler to
/// add many pixels at a time.
constexpr int kDiscRadius_px = kOrbPatch_px / 2;
constexpr int kDiscRow_px = kOrbPatch_px + 1;
static_assert(kDiscRow_px % 16 == 0 && kDiscRadius_px + 1 <= kDescriptorReach_px);
struct DiscRow {
  std::array<std::int16_t, kDiscRow_px> dx{};
  std::array<std::int16_t, kDiscRow_px> one{};
};

[[nodiscard]] constexpr std::array<DiscRow, kOrbPatch_px> disc() {
  std::array<DiscRow, kOrbPatch_px> rows;
  for (int dy = -kDiscRadius_px; dy <= kDiscRadius_px; ++dy) {
    DiscRow& row = rows[static_cast<std::size_t>(dy + kDiscRadius_px)];
    for (int dx = -kDiscRadius_px; dx <= kDiscRadius_px; ++dx) {
      if (dx * dx + dy * dy > kDiscRadius_px * kDiscRadius_px) continue;
      row.dx[static_cast<std::size_t>(dx + kDiscRadius_px)] = static_cast<std::int16_t>(dx);
      row.one[static_cast<std::size_t>(dx + kDiscRadius_px)] = 1;
    }
  }
  return rows;
}

/// Direction from a pixel to the centroid of the grey values around it, degrees in [0, 360): the orientation
/// of ORB.
[[nodiscard]] float orientation(const cv::Mat& image, cv::Point centre) {
  static constexpr auto kDisc = disc();
  int along_x = 0;
  int along_y = 0;
  for (int dy = -kDiscRadius_px; dy <= kDiscRadius_px; ++dy) {
    const DiscRow& row = kDisc[static_cast<std::size_t>(dy + kDiscRadius_px)];
    const std::uint8_t* pixels = image.ptr<std::uint8_t>(centre.y + dy) + centre.x - kDiscRadius_px;
    int sum = 0;
    for (std::size_t i = 0; i < kDiscRow_px; ++i) {
      const auto pixel = static_cast<std::int16_t>(pixels[i]);
      along_x += row.dx[i] * pixel;
      sum += row.one[i] * pixel;
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
