// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/stereo_agreement.hpp"

#include <algorithm>
#include <cmath>

#include "stereo_slam/core/corner_pairs.hpp"
#include "stereo_slam/core/parallel.hpp"

namespace stereo_slam {
namespace {

struct Offset {
  double disparity_px;
  double rows_px;
};

template <class Value>
double median(const std::vector<Offset>& offsets, const Value& value) {
  std::vector<double> values(offsets.size());
  std::transform(offsets.begin(), offsets.end(), values.begin(), value);
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

std::vector<std::size_t> spread(std::size_t frames, std::size_t count) {
  std::vector<std::size_t> indices;
  for (std::size_t k = 0; k < std::min(count, frames); ++k)
    indices.push_back(k * frames / std::min(count, frames));
  return indices;
}

StereoAgreement check_stereo_agreement(const std::vector<StereoFrame>& frames) {
  std::vector<Offset> offsets;
  StereoAgreement agreement;
  for (const auto& frame : frames) {
    ImageCorners left, right;
    run_both([&] { left = find_corners(frame.left); }, [&] { right = find_corners(frame.right); });
    agreement.left_features += left.positions_px.size();
    agreement.right_features += right.positions_px.size();
    for (const auto& [left_px, right_px] : match_corners(left, right)) {
      const cv::Point2f difference = left_px - right_px;
      offsets.push_back({static_cast<double>(difference.x), static_cast<double>(difference.y)});
    }
  }
  if (offsets.empty()) return agreement;
  const auto beyond =
      std::count_if(offsets.begin(), offsets.end(), [](auto& o) { return std::abs(o.disparity_px) > 1.0; });
  const auto negative =
      std::count_if(offsets.begin(), offsets.end(), [](auto& o) { return o.disparity_px < -1.0; });
  agreement.matches = offsets.size();
  agreement.row_offset_px = median(offsets, [](auto& o) { return std::abs(o.rows_px); });
  agreement.median_disparity_px = median(offsets, [](auto& o) { return o.disparity_px; });
  agreement.beyond_share = static_cast<double>(beyond) / static_cast<double>(offsets.size());
  agreement.negative_share = beyond == 0 ? 0.0 : static_cast<double>(negative) / static_cast<double>(beyond);
  return agreement;
}

}  // namespace stereo_slam
