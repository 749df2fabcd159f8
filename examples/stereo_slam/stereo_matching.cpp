// SPDX-License-Identifier: MIT
#include "stereo_matching.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "patch_alignment.hpp"

namespace stereo_slam {
namespace {

constexpr int kRadius_px = 5;
constexpr int kSide_px = 2 * kRadius_px + 1;

/// Sum of absolute differences of two windows given by their first pixels.
[[nodiscard]] int absolute_difference(const cv::Mat& left, const cv::Mat& right, cv::Point a, cv::Point b) {
  int sum = 0;
  for (int row = 0; row < kSide_px; ++row) {
    const std::uint8_t* p = left.ptr<std::uint8_t>(a.y + row) + a.x;
    const std::uint8_t* q = right.ptr<std::uint8_t>(b.y + row) + b.x;
    for (int column = 0; column < kSide_px; ++column) sum += std::abs(p[column] - q[column]);
  }
  return sum;
}

/// Integer disparity of the best window on the row, when no other disparity comes close to it.
[[nodiscard]] std::optional<int> search_row(const cv::Mat& left, const cv::Mat& right, cv::Point centre,
                                            const StereoMatchingSettings& settings) {
  const cv::Point corner(centre.x - kRadius_px, centre.y - kRadius_px);
  if (corner.x < 0 || corner.y < 0 || corner.x + kSide_px > left.cols || corner.y + kSide_px > left.rows) {
    return std::nullopt;
  }
  const int max_disparity = std::min(settings.max_disparity_px, corner.x);
  std::vector<int> cost(static_cast<std::size_t>(max_disparity) + 1);
  for (int d = 0; d <= max_disparity; ++d) {
    cost[static_cast<std::size_t>(d)] = absolute_difference(left, right, corner, {corner.x - d, corner.y});
  }
  const int best = static_cast<int>(std::min_element(cost.begin(), cost.end()) - cost.begin());
  int rival = std::numeric_limits<int>::max();
  for (int d = 0; d <= max_disparity; ++d) {
    if (std::abs(d - best) > 2) rival = std::min(rival, cost[static_cast<std::size_t>(d)]);
  }
  const double best_cost = cost[static_cast<std::size_t>(best)];
  if (best_cost > settings.uniqueness * rival) return std::nullopt;
  return best;
}

[[nodiscard]] std::optional<StereoPoint> match_point(const cv::Mat& left, const cv::Mat& right,
                                                     const Vector2<double>& point_px,
                                                     const StereoMatchingSettings& settings) {
  const cv::Point centre(static_cast<int>(std::lround(point_px.x())), static_cast<int>(std::lround(point_px.y())));
  const auto disparity = search_row(left, right, centre, settings);
  if (!disparity) return std::nullopt;
  const auto patch = PatchTemplate::extract(left, point_px);
  if (!patch) return std::nullopt;
  const auto found = patch->align(right, point_px - Vector2<double>(*disparity, 0.0));
  if (!found || found->correlation < settings.min_correlation) return std::nullopt;
  if (std::abs(found->position_px.y() - point_px.y()) > settings.max_row_error_px) return std::nullopt;
  const double refined = point_px.x() - found->position_px.x();
  if (refined < settings.min_disparity_px) return std::nullopt;
  return StereoPoint(point_px.x(), point_px.y(), refined);
}

}  // namespace

std::vector<std::optional<StereoPoint>> match_stereo(const cv::Mat& left, const cv::Mat& right,
                                                     const std::vector<Vector2<double>>& points_px,
                                                     const StereoMatchingSettings& settings) {
  std::vector<std::optional<StereoPoint>> matches(points_px.size());
  cv::parallel_for_(cv::Range(0, static_cast<int>(points_px.size())), [&](const cv::Range& range) {
    for (auto i = static_cast<std::size_t>(range.start); i < static_cast<std::size_t>(range.end); ++i) {
      matches[i] = match_point(left, right, points_px[i], settings);
    }
  });
  return matches;
}

}  // namespace stereo_slam
