// SPDX-License-Identifier: MIT
#include "stereo_slam/frontend/stereo_matching.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

#include "stereo_slam/core/parallel.hpp"
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

/// Where the pattern around a point of the left image is in the right one, to a whole pixel, if the right
/// image is of a later moment: on the epipolar line from the position at infinity on, which is no row then.
[[nodiscard]] std::optional<Vector2<double>> search_line(const StereoView& view,
                                                         const Vector2<double>& point_px,
                                                         const StereoMatchingSettings& settings) {
  const Vector2<double> infinity_px = view.geometry.right_position(point_px, 0.0);
  const Vector2<double> reach_px =
      view.geometry.right_position(point_px, settings.max_disparity_px) - infinity_px;
  const int columns = std::min(settings.max_disparity_px, static_cast<int>(-reach_px.x()));
  const cv::Size side(kSide_px, kSide_px);
  const auto window = [&](const Vector2<double>& px) {
    const cv::Point centre(static_cast<int>(std::lround(px.x())), static_cast<int>(std::lround(px.y())));
    return cv::Rect(centre - cv::Point(kRadius_px, kRadius_px), side);
  };
  const auto position = [&](int column) -> Vector2<double> {
    return infinity_px + column / -reach_px.x() * reach_px;
  };
  const cv::Rect inside({}, view.frame.left.size());
  const cv::Rect pattern = window(point_px);
  if (columns <= 0 || (pattern & inside) != pattern) return std::nullopt;
  std::vector<double> cost;
  for (int column = 0; column <= columns; ++column) {
    const cv::Rect place = window(position(column));
    const bool visible = (place & inside) == place;
    cost.push_back(visible ? cv::norm(view.frame.left(pattern), view.frame.right(place), cv::NORM_L1)
                           : std::numeric_limits<double>::max());
  }
  const auto smallest = std::min_element(cost.begin(), cost.end());
  const int best = static_cast<int>(smallest - cost.begin());
  double rival = std::numeric_limits<double>::max();
  for (int column = 0; column <= columns; ++column) {
    if (std::abs(column - best) > 2) rival = std::min(rival, cost[static_cast<std::size_t>(column)]);
  }
  if (!(*smallest < settings.uniqueness * rival)) return std::nullopt;
  return position(best);
}

/// Where the pattern around a point of the left image is in the right one, to a whole pixel.
[[nodiscard]] std::optional<Vector2<double>> search(const StereoView& view, const Vector2<double>& point_px,
                                                    const StereoMatchingSettings& settings) {
  if (view.geometry.exposure().is_late()) return search_line(view, point_px, settings);
  const auto rounded = [](double x) { return static_cast<int>(std::lround(x)); };
  const double right_row = view.geometry.right_position(point_px, 0.0).y();
  const auto disparity =
      search_row(view.frame.left, view.frame.right, {rounded(point_px.x()), rounded(point_px.y())},
                 rounded(right_row), settings);
  if (!disparity) return std::nullopt;
  return Vector2<double>(point_px.x() - *disparity, right_row);
}

/// Slopes of the disparity, and how a late right image shows them: as those of the difference of the columns.
class SlopesInRight {
 public:
  SlopesInRight(const LateExposure& exposure, const StereoPoint& z) : is_late_(exposure.is_late()) {
    if (!is_late_) return;
    const Vector2<double> left_px = z.head<2>();
    level_ =
        Vector2<double>::UnitX() - exposure.warp(left_px, z.z(), Vector2<double>::Zero()).row(0).transpose();
    const Vector2<double> unit = Vector2<double>::UnitX();
    per_slope_ = 1.0 - exposure.warp(left_px, z.z(), unit)(0, 0) - level_.x();
  }

  /// As the images show these slopes of surfaces. Valid until the next call.
  [[nodiscard]] std::span<const Vector2<double>> seen(std::span<const Vector2<double>> slopes) {
    if (!is_late_) return slopes;
    seen_.clear();
    for (const auto& slope : slopes) seen_.emplace_back(level_ + per_slope_ * slope);
    return seen_;
  }
  /// The slope of the surface that the images show so.
  [[nodiscard]] Vector2<double> of_surface(const Vector2<double>& seen) const {
    if (!is_late_) return seen;
    return (seen - level_) / per_slope_;
  }

 private:
  bool is_late_;
  Vector2<double> level_ = Vector2<double>::Zero();
  double per_slope_ = 1.0;
  std::vector<Vector2<double>> seen_;
};

[[nodiscard]] std::optional<StereoMeasurement> match_point(const StereoView& view,
                                                           const Vector2<double>& point_px, double texture,
                                                           const StereoMatchingSettings& settings) {
  const cv::Mat& left = view.frame.left;
  const cv::Mat& right = view.frame.right;
  const auto start_px = search(view, point_px, settings);
  if (!start_px) return std::nullopt;
  const auto patch = PatchTemplate::extract(left, point_px, {}, texture);
  if (!patch) return std::nullopt;
  const auto found = patch->align(right, *start_px);
  if (!found || found->correlation < kMinCorrelation) return std::nullopt;
  const auto upright = view.geometry.measure(point_px, found->position_px);
  const LikelySlopes likely(upright.z, view.camera);
  SlopesInRight slopes(view.geometry.exposure(), upright.z);
  const auto slanted = refine_slanted(left, point_px, right, found->position_px, slopes.seen(likely.all()));
  auto measured = view.geometry.measure(point_px, slanted.right_px);
  measured.disparity_slope = slopes.of_surface(slanted.disparity_slope);
  measured.correlation = std::max(found->correlation, slanted.correlation);
  measured.on_common_surface = likely.contain(measured.disparity_slope);
  // The left position was not aligned. The noise of the left patch counts as much as that of the right one.
  measured.covariance_px2 =
      measured.with_disparity(stereo_patch_covariance(found->covariance_px2, found->covariance_px2));
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
  run_each(points_px.size(),
           [&](std::size_t i) { matches[i] = match_point(view, points_px[i], texture, settings); });
  return matches;
}

}  // namespace stereo_slam
