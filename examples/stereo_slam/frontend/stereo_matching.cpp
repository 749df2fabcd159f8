// SPDX-License-Identifier: MIT
#include "stereo_slam/frontend/stereo_matching.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <span>

#include "stereo_slam/frontend/patch_alignment.hpp"
#include "stereo_slam/frontend/slanted_match.hpp"

namespace stereo_slam {
namespace {

constexpr int kRadius_px = 5;
constexpr int kSide_px = 2 * kRadius_px + 1;

/// Sums of absolute differences of a window of the left image, given by its first pixel, and windows of the
/// right image on the rows from `right_top` on, one for each disparity from `cost.size() - 1` down to zero:
/// in the order in which the right image has them, so that the inner loop runs along its rows.
void sum_absolute_differences(const cv::Mat& left, const cv::Mat& right, cv::Point corner, int right_top,
                              std::vector<std::uint16_t>& cost) {
  std::fill(cost.begin(), cost.end(), std::uint16_t{0});
  const std::size_t count = cost.size();
  const int first_column = corner.x - static_cast<int>(count) + 1;
  for (int row = 0; row < kSide_px; ++row) {
    const std::uint8_t* p = left.ptr<std::uint8_t>(corner.y + row) + corner.x;
    const std::uint8_t* q = right.ptr<std::uint8_t>(right_top + row) + first_column;
    for (int column = 0; column < kSide_px; ++column) {
      const int wanted = p[column];
      for (std::size_t i = 0; i < count; ++i) {
        cost[i] =
            static_cast<std::uint16_t>(cost[i] + std::abs(wanted - q[static_cast<std::size_t>(column) + i]));
      }
    }
  }
}

/// Integer disparity of the best window on the row, when no other disparity comes close to it.
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
  sum_absolute_differences(left, right, corner, right_top, cost);
  const auto smallest = std::min_element(cost.rbegin(), cost.rend());
  const int best = static_cast<int>(smallest - cost.rbegin());
  int rival = std::numeric_limits<int>::max();
  for (int d = 0; d <= max_disparity; ++d) {
    const int other = cost[static_cast<std::size_t>(max_disparity - d)];
    if (std::abs(d - best) > 2) rival = std::min(rival, other);
  }
  const double best_cost = *smallest;
  if (!(best_cost < settings.uniqueness * rival)) return std::nullopt;  // nor if both are 0
  return best;
}

/// Slopes of the disparity that common surfaces through a point have: one that faces the camera, a horizontal
/// one, and a vertical one along the optical axis.
class LikelySlopes {
 public:
  LikelySlopes(const StereoPoint& z, const StereoCamera& camera) {
    constexpr double kSteepest = 0.8;  // beyond it a patch is hardly seen
    add(Vector2<double>::Zero());
    const double horizontal = z.z() / (z.y() - camera.cy);
    if (horizontal > 0.0 && horizontal < kSteepest) add({0.0, horizontal});
    const double vertical = z.z() / (z.x() - camera.cx);
    if (std::abs(vertical) < kSteepest) add({vertical, 0.0});
  }

  [[nodiscard]] std::span<const Vector2<double>> all() const { return {slopes_.data(), count_}; }

 private:
  void add(const Vector2<double>& slope) { slopes_[count_++] = slope; }

  std::array<Vector2<double>, 3> slopes_;
  std::size_t count_ = 0;
};

[[nodiscard]] std::optional<RectificationResidual::Measurement> match_point(
    const StereoView& view, const Vector2<double>& point_px, double texture,
    const StereoMatchingSettings& settings) {
  const cv::Mat& left = view.frame.left;
  const cv::Mat& right = view.frame.right;
  const auto rounded = [](double x) { return static_cast<int>(std::lround(x)); };
  const double right_row = view.rectification.right_position({point_px.x(), point_px.y(), 0.0}).y();
  const auto disparity =
      search_row(left, right, {rounded(point_px.x()), rounded(point_px.y())}, rounded(right_row), settings);
  if (!disparity) return std::nullopt;
  const auto patch = PatchTemplate::extract(left, point_px, {}, texture);
  if (!patch) return std::nullopt;
  const auto found = patch->align(right, {point_px.x() - *disparity, right_row});
  if (!found || found->correlation < settings.min_correlation) return std::nullopt;
  const auto upright = view.rectification.measure(point_px, found->position_px);
  const LikelySlopes likely(upright.z, view.camera);
  const auto slanted = refine_slanted(left, point_px, right, found->position_px, likely.all());
  auto measured = view.rectification.measure(point_px, slanted.right_px);
  measured.disparity_slope = slanted.disparity_slope;
  // The noise of the left patch displaces its centre as much as that of the right one the alignment.
  measured.covariance_px2 = stereo_patch_covariance(found->covariance_px2, found->covariance_px2);
  if (std::abs(measured.row_error_px) > settings.max_row_error_px) return std::nullopt;
  if (measured.z.z() < settings.min_disparity_px) return std::nullopt;
  return measured;
}

}  // namespace

std::vector<std::optional<RectificationResidual::Measurement>> match_stereo(
    const StereoView& view, const std::vector<Vector2<double>>& points_px,
    const StereoMatchingSettings& settings) {
  std::vector<std::optional<RectificationResidual::Measurement>> matches(points_px.size());
  const double texture = min_texture(view.frame.left);
  cv::parallel_for_(cv::Range(0, static_cast<int>(points_px.size())), [&](const cv::Range& range) {
    for (auto i = static_cast<std::size_t>(range.start); i < static_cast<std::size_t>(range.end); ++i) {
      matches[i] = match_point(view, points_px[i], texture, settings);
    }
  });
  return matches;
}

}  // namespace stereo_slam
