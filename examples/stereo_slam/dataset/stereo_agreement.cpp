// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/stereo_agreement.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "stereo_slam/core/corner_pairs.hpp"
#include "stereo_slam/core/median.hpp"
#include "stereo_slam/core/parallel.hpp"

namespace stereo_slam {
namespace {

struct Offset {
  double disparity_px;
  double rows_px;
};

template <class Value>
double median_of(const std::vector<Offset>& offsets, const Value& value) {
  std::vector<double> values(offsets.size());
  std::ranges::transform(offsets, values.begin(), value);
  return median(std::move(values));
}

/// The disparity of near points: 90 % of the matches whose rows agree have a smaller one.
double near_disparity_px(const std::vector<Offset>& offsets) {
  constexpr double kMostRows_px = 2.0;
  constexpr double kShare = 0.9;
  std::vector<double> disparities_px;
  for (const auto& [disparity_px, rows_px] : offsets) {
    if (std::abs(rows_px) < kMostRows_px) disparities_px.push_back(disparity_px);
  }
  return quantile(std::move(disparities_px), kShare);
}

}  // namespace

std::vector<std::size_t> spread(std::size_t frames, std::size_t count) {
  std::vector<std::size_t> indices;
  for (std::size_t k = 0; k < std::min(count, frames); ++k)
    indices.push_back(k * frames / std::min(count, frames));
  return indices;
}

StereoAgreement check_stereo_agreement(const std::vector<StereoFrame>& frames) {
  std::vector<ImageCorners> corners(2 * frames.size());
  run_each(corners.size(), [&](std::size_t i) {
    corners[i] = find_corners(i % 2 == 0 ? frames[i / 2].left : frames[i / 2].right);
  });
  std::vector<std::vector<CornerPair>> pairs(frames.size());
  run_each(pairs.size(),
           [&](std::size_t i) { pairs[i] = match_corners(corners[2 * i], corners[2 * i + 1]); });
  std::vector<Offset> offsets;
  StereoAgreement agreement;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const ImageCorners& left = corners[2 * i];
    const ImageCorners& right = corners[2 * i + 1];
    agreement.unit_px = static_cast<double>(left.unit_px);
    agreement.left_features += left.positions_px.size();
    agreement.right_features += right.positions_px.size();
    for (const auto& [left_px, right_px] : pairs[i]) {
      const cv::Point2f difference = left_px - right_px;
      offsets.push_back({static_cast<double>(difference.x), static_cast<double>(difference.y)});
    }
  }
  if (offsets.empty()) return agreement;
  const auto beyond = std::ranges::count_if(offsets, [](auto& o) { return std::abs(o.disparity_px) > 1.0; });
  const auto negative = std::ranges::count_if(offsets, [](auto& o) { return o.disparity_px < -1.0; });
  agreement.matches = offsets.size();
  agreement.row_offset_px = median_of(offsets, [](auto& o) { return std::abs(o.rows_px); });
  agreement.median_disparity_px = median_of(offsets, [](auto& o) { return o.disparity_px; });
  agreement.near_disparity_px = near_disparity_px(offsets);
  agreement.beyond_share = static_cast<double>(beyond) / static_cast<double>(offsets.size());
  // Few large disparities of a far scene are wrong matches; there the median tells the sign.
  constexpr double kLeastShare = 0.05;
  constexpr double kNoise_px = 0.1;
  agreement.negative_share = agreement.beyond_share >= kLeastShare
                                 ? static_cast<double>(negative) / static_cast<double>(beyond)
                             : agreement.median_disparity_px < -kNoise_px ? 1.0
                                                                          : 0.0;
  return agreement;
}

}  // namespace stereo_slam
