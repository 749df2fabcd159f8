// SPDX-License-Identifier: MIT
#include "stereo_slam/frontend/stereo_matching.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

#include "stereo_slam/frontend/likely_slopes.hpp"
#include "stereo_slam/frontend/patch_alignment.hpp"
#include "stereo_slam/frontend/slanted_match.hpp"

namespace stereo_slam {
namespace {

constexpr double kMinDisparity_px = 0.3;  // of a match
constexpr double kMaxRowError_px = 1.0;   // of a match: epipolar check
constexpr double kMinCorrelation = 0.85;  // of the aligned patches

constexpr int kRadius_px = 5;
constexpr int kSide_px = 2 * kRadius_px + 1;

/// A window of the left image and the rows of the right one that it is compared with, by their first pixels.
struct RowSearch {
  const cv::Mat& left;
  const cv::Mat& right;
  cv::Point left_corner;
  cv::Point right_corner;  ///< of the window with the largest disparity
};

constexpr std::size_t kLanes = 16;

/// Sums of absolute differences of the window and `kLanes` windows of the right image, from `first` on.
[[gnu::always_inline]] inline void sum_lanes(const RowSearch& search, std::size_t first,
                                             std::uint16_t* sums) {
  using Bytes [[gnu::vector_size(kLanes)]] = std::uint8_t;
  using Words [[gnu::vector_size(2 * kLanes)]] = std::int16_t;
  Words sum{};
  for (int row = 0; row < kSide_px; ++row) {
    const std::uint8_t* p = search.left.ptr(search.left_corner.y + row) + search.left_corner.x;
    const std::uint8_t* q = search.right.ptr(search.right_corner.y + row) + search.right_corner.x + first;
    for (int column = 0; column < kSide_px; ++column) {
      Bytes bytes;
      std::memcpy(&bytes, q + column, sizeof bytes);
      const Words difference = __builtin_convertvector(bytes, Words) - static_cast<std::int16_t>(p[column]);
      sum += difference < 0 ? -difference : difference;
    }
  }
  std::memcpy(sums, &sum, sizeof sum);
}

/// Sums of absolute differences for each disparity from `cost.size() - 1` down to zero: in the order in which
/// the right image has the windows, so that neighbouring ones are summed at once.
[[gnu::always_inline]] inline void sum_all(const RowSearch& search, std::vector<std::uint16_t>& cost) {
  const std::size_t count = cost.size();
  if (count >= kLanes) {
    for (std::size_t i = 0; i + kLanes < count; i += kLanes) sum_lanes(search, i, cost.data() + i);
    sum_lanes(search, count - kLanes, cost.data() + count - kLanes);
    return;
  }
  for (std::size_t i = 0; i < count; ++i) {
    const cv::Point corner = search.right_corner + cv::Point(static_cast<int>(i), 0);
    const cv::Size side(kSide_px, kSide_px);
    const double sum =
        cv::norm(search.left({search.left_corner, side}), search.right({corner, side}), cv::NORM_L1);
    cost[i] = static_cast<std::uint16_t>(sum);
  }
}

#ifdef __x86_64__
/// sum_all() with AVX2: sixteen 16-bit numbers per register instead of eight.
[[gnu::target("avx2")]] void sum_all_avx2(const RowSearch& search, std::vector<std::uint16_t>& cost) {
  sum_all(search, cost);
}
#endif

void sum_absolute_differences(const RowSearch& search, std::vector<std::uint16_t>& cost) {
#ifdef __x86_64__
  static const bool has_avx2 = __builtin_cpu_supports("avx2");
  if (has_avx2) return sum_all_avx2(search, cost);
#endif
  sum_all(search, cost);
}

/// Integer disparity of the window with the smallest cost on the row; nothing if another disparity, at least
/// 3 px away, has a similar cost.
[[nodiscard]] std::optional<int> search_row(const cv::Mat& left, const cv::Mat& right, cv::Point centre,
                                            int right_row, const StereoMatchingSettings& settings) {
  const cv::Point corner(centre.x - kRadius_px, centre.y - kRadius_px);
  const int right_top = right_row - kRadius_px;
  if (corner.x < 0 || std::min(corner.y, right_top) < 0 || corner.x + kSide_px > left.cols ||
      std::max(corner.y, right_top) + kSide_px > left.rows) {
    return std::nullopt;
  }
  const int max_disparity = std::min(settings.max_disparity_px, corner.x);
  std::vector<std::uint16_t> cost(static_cast<std::size_t>(max_disparity) + 1);  // by decreasing disparity
  sum_absolute_differences({left, right, corner, {corner.x - max_disparity, right_top}}, cost);
  const auto smallest = std::min_element(cost.rbegin(), cost.rend());
  const int best = static_cast<int>(smallest - cost.rbegin());
  int rival = std::numeric_limits<int>::max();
  for (int d = 0; d <= max_disparity; ++d) {
    const int other = cost[static_cast<std::size_t>(max_disparity - d)];
    if (std::abs(d - best) > 2) rival = std::min(rival, other);
  }
  const double best_cost = *smallest;
  if (!(best_cost < settings.uniqueness * rival)) return std::nullopt;  // also if both costs are 0
  return best;
}

[[nodiscard]] std::optional<StereoMeasurement> match_point(const StereoView& view,
                                                           const Vector2<double>& point_px, double texture,
                                                           const StereoMatchingSettings& settings) {
  const cv::Mat& left = view.frame.left;
  const cv::Mat& right = view.frame.right;
  const auto rounded = [](double x) { return static_cast<int>(std::lround(x)); };
  const double right_row = view.rectification.right_position(point_px, 0.0).y();
  const auto disparity =
      search_row(left, right, {rounded(point_px.x()), rounded(point_px.y())}, rounded(right_row), settings);
  if (!disparity) return std::nullopt;
  const auto patch = PatchTemplate::extract(left, point_px, {}, texture);
  if (!patch) return std::nullopt;
  const auto found = patch->align(right, {point_px.x() - *disparity, right_row});
  if (!found || found->correlation < kMinCorrelation) return std::nullopt;
  const auto upright = view.rectification.measure(point_px, found->position_px);
  const LikelySlopes likely(upright.z, view.camera);
  const auto slanted = refine_slanted(left, point_px, right, found->position_px, likely.all());
  auto measured = view.rectification.measure(point_px, slanted.right_px);
  measured.disparity_slope = slanted.disparity_slope;
  measured.correlation = std::max(found->correlation, slanted.correlation);
  measured.on_common_surface = likely.contain(slanted.disparity_slope);
  // The left position was not aligned. The noise of the left patch counts as much as that of the right one.
  measured.covariance_px2 = stereo_patch_covariance(found->covariance_px2, found->covariance_px2);
  if (std::abs(measured.row_error_px) > kMaxRowError_px) return std::nullopt;
  if (measured.z.z() < kMinDisparity_px) return std::nullopt;
  return measured;
}

}  // namespace

std::vector<std::optional<StereoMeasurement>> match_stereo(const StereoView& view,
                                                           const std::vector<Vector2<double>>& points_px,
                                                           const StereoMatchingSettings& settings) {
  std::vector<std::optional<StereoMeasurement>> matches(points_px.size());
  const double texture = min_texture(view.frame.left);
  cv::parallel_for_(cv::Range(0, static_cast<int>(points_px.size())), [&](const cv::Range& range) {
    for (auto i = static_cast<std::size_t>(range.start); i < static_cast<std::size_t>(range.end); ++i) {
      matches[i] = match_point(view, points_px[i], texture, settings);
    }
  });
  return matches;
}

}  // namespace stereo_slam
