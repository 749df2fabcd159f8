// SPDX-License-Identifier: MIT
#include "stereo_slam/frontend/corners.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <span>
#include <utility>

#include <opencv2/core/hal/intrin.hpp>
#include <opencv2/features2d.hpp>

#include "stereo_slam/frontend/features.hpp"
#include "stereo_slam/frontend/spatial_index.hpp"

namespace stereo_slam {
namespace {

constexpr int kTensorRadius_px = 3;
constexpr int kExaminedPerCorner = 8;
constexpr int kOrbPatch_px = 31;

/// Thresholds for a corner.
struct CornerStrength {
  int fast_threshold = 0;       ///< grey levels
  double min_eigenvalue = 0.0;  ///< grey levels^2
};

constexpr CornerStrength kClear{20, 2000.0};
constexpr CornerStrength kStrong{10, 2000.0};
constexpr CornerStrength kWeak{5, 900.0};  // hardly more than the alignment of patches needs

/// Smallest eigenvalue of the structure tensor around a pixel, grey levels^2.
[[nodiscard]] double smallest_eigenvalue(const cv::Mat& image, cv::Point centre) {
  static_assert(kTensorRadius_px == 3, "a row has seven pixels, one less than a register");
  const cv::v_int16x8 in_row(1, 1, 1, 1, 1, 1, 1, 0);
  const auto pixels = [](const std::uint8_t* p) { return cv::v_reinterpret_as_s16(cv::v_load_expand(p)); };
  cv::v_int32x4 xx = cv::v_setzero_s32();
  cv::v_int32x4 xy = cv::v_setzero_s32();
  cv::v_int32x4 yy = cv::v_setzero_s32();
  for (int row = centre.y - kTensorRadius_px; row <= centre.y + kTensorRadius_px; ++row) {
    const std::uint8_t* line = image.ptr<std::uint8_t>(row) + centre.x - kTensorRadius_px;
    // Functions, not operators, which OpenCV 4.11 no longer has for these types.
    const auto dx = cv::v_sub_wrap(pixels(line + 1), pixels(line - 1));
    const auto dy = cv::v_sub_wrap(pixels(line + image.step), pixels(line - image.step));
    const auto dx_in_row = cv::v_mul_wrap(dx, in_row);
    xx = cv::v_dotprod(dx_in_row, dx, xx);
    xy = cv::v_dotprod(dx_in_row, dy, xy);
    yy = cv::v_dotprod(cv::v_mul_wrap(dy, in_row), dy, yy);
  }
  const double sum_xx = cv::v_reduce_sum(xx);
  const double sum_yy = cv::v_reduce_sum(yy);
  const double half_trace = 0.125 * (sum_xx + sum_yy);  // dx and dy are twice the gradient: a factor of 1/4
  const double half_difference = 0.125 * (sum_xx - sum_yy);
  const double off_diagonal = 0.25 * cv::v_reduce_sum(xy);
  return half_trace - std::sqrt(half_difference * half_difference + off_diagonal * off_diagonal);
}

/// The part of the image where corners may be: away from its border. Empty for a small image.
[[nodiscard]] cv::Rect inner_part(cv::Size image) {
  return {kDescriptorReach_px, kDescriptorReach_px, std::max(0, image.width - 2 * kDescriptorReach_px),
          std::max(0, image.height - 2 * kDescriptorReach_px)};
}

/// The FAST corners of a part of the image, row by row.
[[nodiscard]] std::vector<cv::KeyPoint> fast_corners(const cv::Mat& image, const cv::Rect& part,
                                                     int threshold) {
  // FAST skips a border of three pixels, and non-maximum suppression needs one more.
  constexpr int kMargin_px = 4;
  const cv::Point corner = part.tl() - cv::Point(kMargin_px, kMargin_px);
  const cv::Rect with_margin(corner, part.size() + cv::Size(2 * kMargin_px, 2 * kMargin_px));
  std::vector<cv::KeyPoint> keypoints;
  cv::FAST(image(with_margin), keypoints, threshold, /*nonmaxSuppression=*/true);
  for (auto& keypoint : keypoints) keypoint.pt += cv::Point2f(corner);
  std::erase_if(keypoints, [&](const cv::KeyPoint& k) { return !part.contains(cv::Point(k.pt)); });
  return keypoints;
}

/// The FAST corners of the whole image, row by row.
[[nodiscard]] std::vector<cv::KeyPoint> fast_corners(const cv::Mat& image, int threshold) {
  constexpr int kStrip_px = 48;  // high enough for the margins not to count, and several for each thread
  const cv::Rect inner = inner_part(image.size());
  if (inner.empty()) return {};
  std::vector<std::vector<cv::KeyPoint>> strips(
      static_cast<std::size_t>((inner.height + kStrip_px - 1) / kStrip_px));
  cv::parallel_for_(cv::Range(0, static_cast<int>(strips.size())), [&](const cv::Range& range) {
    for (int i = range.start; i < range.end; ++i) {
      const cv::Rect strip(inner.x, inner.y + i * kStrip_px, inner.width, kStrip_px);
      strips[static_cast<std::size_t>(i)] = fast_corners(image, strip & inner, threshold);
    }
  });
  std::vector<cv::KeyPoint> all;
  for (const auto& strip : strips) all.insert(all.end(), strip.begin(), strip.end());
  return all;
}

/// Corners of the whole image that were found already, row by row; null if none were.
using KnownCorners = const std::vector<cv::KeyPoint>*;

/// Search for corners in one row of cells. `wanted` is the number of corners to find in each cell; cells that
/// want none are skipped.
class CellRow {
 public:
  CellRow(const cv::Mat& image, const CornerGrid& grid, const CornerStrength& strength, int row,
          std::span<const int> wanted)
      : image_(image),
        grid_(grid),
        strength_(strength),
        wanted_(wanted),
        cells_(wanted.size()),
        part_(cv::Rect(0, row * grid.cell_px, image.cols, grid.cell_px) & inner_part(image.size())) {}

  /// Finds the FAST corners of the cells, or takes the known ones.
  void find(KnownCorners known) {
    if (part_.empty()) return;
    if (known != nullptr) return take(*known);
    for (std::size_t first = 0; first < wanted_.size(); ++first) {
      if (wanted_[first] <= 0) continue;
      std::size_t end = first + 1;
      while (end < wanted_.size() && wanted_[end] > 0) ++end;
      const cv::Rect cells(static_cast<int>(first) * grid_.cell_px, part_.y,
                           static_cast<int>(end - first) * grid_.cell_px, part_.height);
      const cv::Rect inside = cells & part_;
      if (!inside.empty()) take(fast_corners(image_, inside, strength_.fast_threshold));
      first = end;
    }
  }

  /// The best corners of every cell, away from the used points and each other.
  [[nodiscard]] std::vector<Feature> best(const SpatialIndex& used) {
    std::vector<Feature> corners;
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      for (auto& corner : best_of_cell(cells_[i], wanted_[i], used)) corners.push_back(std::move(corner));
    }
    return corners;
  }

 private:
  /// Puts the corners of this row into their cells. `corners` are ordered by rows.
  void take(const std::vector<cv::KeyPoint>& corners) {
    const auto above = [](const cv::KeyPoint& k, int y) { return k.pt.y < static_cast<float>(y); };
    const auto first = std::lower_bound(corners.begin(), corners.end(), part_.y, above);
    const auto end = std::lower_bound(first, corners.end(), part_.br().y, above);
    for (auto corner = first; corner != end; ++corner) {
      const auto cell = static_cast<std::size_t>(static_cast<int>(corner->pt.x) / grid_.cell_px);
      if (wanted_[cell] > 0) cells_[cell].push_back(*corner);
    }
  }

  [[nodiscard]] std::vector<Feature> best_of_cell(std::vector<cv::KeyPoint>& keypoints, int wanted,
                                                  const SpatialIndex& used) const {
    // FAST's score is coarse; it decides only which corners are worth the structure tensor.
    const auto examined = std::min(keypoints.size(), static_cast<std::size_t>(kExaminedPerCorner * wanted));
    std::partial_sort(keypoints.begin(), keypoints.begin() + static_cast<std::ptrdiff_t>(examined),
                      keypoints.end(), [](const cv::KeyPoint& a, const cv::KeyPoint& b) {
                        return a.response != b.response
                                   ? a.response > b.response
                                   : std::pair(a.pt.y, a.pt.x) < std::pair(b.pt.y, b.pt.x);
                      });
    std::vector<Feature> found;
    for (std::size_t i = 0; i < examined; ++i) {
      const cv::Point at(static_cast<int>(keypoints[i].pt.x), static_cast<int>(keypoints[i].pt.y));
      Feature feature;
      feature.position_px = {static_cast<double>(at.x), static_cast<double>(at.y)};
      if (used.any_within(feature.position_px, grid_.min_distance_px)) continue;
      feature.response = smallest_eigenvalue(image_, at);
      if (feature.response >= strength_.min_eigenvalue) found.push_back(feature);
    }
    std::stable_sort(found.begin(), found.end(),
                     [](const Feature& a, const Feature& b) { return a.response > b.response; });
    std::vector<Feature> kept;
    for (const auto& candidate : found) {
      if (static_cast<int>(kept.size()) == wanted) break;
      const bool crowded = std::any_of(kept.begin(), kept.end(), [&](const Feature& k) {
        return (k.position_px - candidate.position_px).norm() < grid_.min_distance_px;
      });
      if (!crowded) kept.push_back(candidate);
    }
    return kept;
  }

  const cv::Mat& image_;
  const CornerGrid& grid_;
  const CornerStrength& strength_;
  std::span<const int> wanted_;
  std::vector<std::vector<cv::KeyPoint>> cells_;
  cv::Rect part_;  // of the image, without its border
};

/// Number of corners to add to every cell, row by row: grid.per_cell less the points present, and zero in
/// cells that are at least half full.
[[nodiscard]] std::vector<int> room_by_cell(const std::vector<Vector2<double>>& present_px, cv::Size cells,
                                            const CornerGrid& grid) {
  std::vector<int> room(static_cast<std::size_t>(cells.area()), grid.per_cell);
  for (const auto& px : present_px) {
    const int column = static_cast<int>(std::floor(px.x() / grid.cell_px));
    const int row = static_cast<int>(std::floor(px.y() / grid.cell_px));
    if (column < 0 || row < 0 || column >= cells.width || row >= cells.height) continue;
    --room[static_cast<std::size_t>(row * cells.width + column)];
  }
  for (int& n : room) {
    if (2 * n <= grid.per_cell) n = 0;
  }
  return room;
}

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

/// The corners without those that are nearer than `min_distance_px` to a stronger one, which is in another
/// cell: within a cell they are already apart.
[[nodiscard]] std::vector<Feature> apart(const std::vector<Feature>& corners, cv::Size image,
                                         double min_distance_px) {
  const SpatialIndex index(positions(corners), image);
  std::vector<Feature> kept;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    bool crowded = false;
    index.for_each_in_box(
        corners[i].position_px, Vector2<double>::Constant(min_distance_px), [&](std::size_t k) {
          const bool near = (corners[k].position_px - corners[i].position_px).norm() < min_distance_px;
          const bool stronger = corners[k].response > corners[i].response ||
                                (corners[k].response == corners[i].response && k < i);
          crowded = crowded || (near && stronger);
        });
    if (!crowded) kept.push_back(corners[i]);
  }
  return kept;
}

/// What to search for.
struct Wanted {
  CornerStrength strength;
  std::span<const int> room;     ///< of each cell
  KnownCorners known = nullptr;  ///< of this strength
};

/// The wanted corners, as many as the cells have room for.
[[nodiscard]] std::vector<Feature> search_cells(const cv::Mat& image, const SpatialIndex& used,
                                                const CornerGrid& grid, const Wanted& wanted) {
  const auto columns = static_cast<std::size_t>((image.cols + grid.cell_px - 1) / grid.cell_px);
  std::vector<std::vector<Feature>> by_row(wanted.room.size() / columns);
  cv::parallel_for_(cv::Range(0, static_cast<int>(by_row.size())), [&](const cv::Range& range) {
    for (int row = range.start; row < range.end; ++row) {
      const auto room = wanted.room.subspan(static_cast<std::size_t>(row) * columns, columns);
      CellRow cells(image, grid, wanted.strength, row, room);
      cells.find(wanted.known);
      by_row[static_cast<std::size_t>(row)] = cells.best(used);
    }
  });
  std::vector<Feature> corners;
  for (const auto& row : by_row) corners.insert(corners.end(), row.begin(), row.end());
  return apart(corners, image.size(), grid.min_distance_px);
}

}  // namespace

std::vector<Feature> CornerDetector::detect(const std::vector<Vector2<double>>& present_px,
                                            const std::vector<Vector2<double>>& reserved_px,
                                            const CornerGrid& grid) const {
  if (image_.empty()) return {};
  const cv::Size cells((image_.cols + grid.cell_px - 1) / grid.cell_px,
                       (image_.rows + grid.cell_px - 1) / grid.cell_px);
  const auto room = room_by_cell(present_px, cells, grid);
  std::vector<Vector2<double>> used_px = present_px;
  used_px.insert(used_px.end(), reserved_px.begin(), reserved_px.end());
  const SpatialIndex used(used_px, image_.size());
  const bool everywhere = std::all_of(room.begin(), room.end(), [](int n) { return n > 0; });
  if (!clear_ && everywhere) clear_ = fast_corners(image_, kClear.fast_threshold);
  auto corners = search_cells(image_, used, grid, {kClear, room, clear_ ? &*clear_ : nullptr});
  if (!grid.fill_empty_cells && corners.size() >= grid.enough) return corners;

  // FAST takes longer the lower its threshold: at first it is lowered only in cells that remained empty.
  for (const CornerStrength& strength : {kStrong, kWeak}) {
    const auto found_px = positions(corners);
    const auto room_beside_found = room_by_cell(found_px, cells, grid);
    auto empty = room;
    for (std::size_t i = 0; i < room.size(); ++i) {
      if (room_beside_found[i] < grid.per_cell) empty[i] = 0;
    }
    auto taken_px = used_px;
    taken_px.insert(taken_px.end(), found_px.begin(), found_px.end());
    const auto more = search_cells(image_, SpatialIndex(taken_px, image_.size()), grid, {strength, empty});
    corners.insert(corners.end(), more.begin(), more.end());
    if (corners.size() >= grid.enough) return corners;
  }
  return search_cells(image_, used, grid, {kWeak, room});
}

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
                           static_cast<float>(kOrbPatch_px), orientation(image, at), 0.0F, 0,
                           static_cast<int>(i));
  }
  if (keypoints.empty()) return descriptors;
  const auto orb = cv::ORB::create(static_cast<int>(keypoints.size()), 2.0F, 1, kDescriptorReach_px, 0, 2,
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
