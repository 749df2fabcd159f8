// SPDX-License-Identifier: MIT
#include "stereo_slam/frontend/corners.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <span>
#include <utility>

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
  int xx = 0;
  int xy = 0;
  int yy = 0;
  for (int row = centre.y - kTensorRadius_px; row <= centre.y + kTensorRadius_px; ++row) {
    const std::uint8_t* line = image.ptr<std::uint8_t>(row) + centre.x - kTensorRadius_px;
    const std::uint8_t* above = line - image.step;
    const std::uint8_t* below = line + image.step;
    for (int i = 0; i <= 2 * kTensorRadius_px; ++i) {
      const int dx = line[i + 1] - line[i - 1];
      const int dy = below[i] - above[i];
      xx += dx * dx;
      xy += dx * dy;
      yy += dy * dy;
    }
  }
  const double half_trace = 0.125 * (xx + yy);  // dx and dy are twice the gradient: a factor of 1/4
  const double half_difference = 0.125 * (xx - yy);
  const double off_diagonal = 0.25 * xy;
  return half_trace - std::hypot(half_difference, off_diagonal);
}

/// Search for corners in one row of cells. `wanted` is the number of corners to find in each cell; cells that
/// want none are skipped.
class CellRow {
 public:
  CellRow(const cv::Mat& image, const CornerGrid& grid, const CornerStrength& strength, int row,
          std::span<const int> wanted)
      : image_(image), grid_(grid), strength_(strength), wanted_(wanted), cells_(wanted.size()) {
    const int top = std::max(row * grid.cell_px, kDescriptorReach_px);
    const int bottom = std::min((row + 1) * grid.cell_px, image.rows - kDescriptorReach_px);
    if (bottom <= top) return;
    for (std::size_t first = 0; first < wanted.size(); ++first) {
      if (wanted[first] <= 0) continue;
      std::size_t end = first + 1;
      while (end < wanted.size() && wanted[end] > 0) ++end;
      const int left = std::max(static_cast<int>(first) * grid.cell_px, kDescriptorReach_px);
      const int right = std::min(static_cast<int>(end) * grid.cell_px, image.cols - kDescriptorReach_px);
      if (left < right) detect({{left, top}, cv::Point(right, bottom)});
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
  /// Finds the corners of a part of the image.
  void detect(const cv::Rect& part) {
    // FAST skips a border of three pixels, and non-maximum suppression needs one more.
    constexpr int kMargin_px = 4;
    const cv::Point corner = part.tl() - cv::Point(kMargin_px, kMargin_px);
    const cv::Rect with_margin(corner, part.size() + cv::Size(2 * kMargin_px, 2 * kMargin_px));
    std::vector<cv::KeyPoint> keypoints;
    cv::FAST(image_(with_margin), keypoints, strength_.fast_threshold, /*nonmaxSuppression=*/true);
    for (auto& keypoint : keypoints) {
      keypoint.pt += cv::Point2f(corner);
      const cv::Point at(keypoint.pt);
      if (part.contains(at)) cells_[static_cast<std::size_t>(at.x / grid_.cell_px)].push_back(keypoint);
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

/// Corners of at least this strength, as many as the cells have room for.
[[nodiscard]] std::vector<Feature> search_cells(const cv::Mat& image, const SpatialIndex& used,
                                                const CornerGrid& grid, std::span<const int> room,
                                                const CornerStrength& strength) {
  const auto columns = static_cast<std::size_t>((image.cols + grid.cell_px - 1) / grid.cell_px);
  std::vector<std::vector<Feature>> by_row(room.size() / columns);
  cv::parallel_for_(cv::Range(0, static_cast<int>(by_row.size())), [&](const cv::Range& range) {
    for (int row = range.start; row < range.end; ++row) {
      const auto wanted = room.subspan(static_cast<std::size_t>(row) * columns, columns);
      by_row[static_cast<std::size_t>(row)] = CellRow(image, grid, strength, row, wanted).best(used);
    }
  });
  std::vector<Feature> corners;
  for (const auto& row : by_row) corners.insert(corners.end(), row.begin(), row.end());
  return apart(corners, image.size(), grid.min_distance_px);
}

}  // namespace

std::vector<Feature> detect_corners(const cv::Mat& image, const std::vector<Vector2<double>>& present_px,
                                    const std::vector<Vector2<double>>& reserved_px, const CornerGrid& grid) {
  if (image.empty()) return {};
  const cv::Size cells((image.cols + grid.cell_px - 1) / grid.cell_px,
                       (image.rows + grid.cell_px - 1) / grid.cell_px);
  const auto room = room_by_cell(present_px, cells, grid);
  std::vector<Vector2<double>> used_px = present_px;
  used_px.insert(used_px.end(), reserved_px.begin(), reserved_px.end());
  const SpatialIndex used(used_px, image.size());
  auto corners = search_cells(image, used, grid, room, kClear);
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
    const auto more = search_cells(image, SpatialIndex(taken_px, image.size()), grid, empty, strength);
    corners.insert(corners.end(), more.begin(), more.end());
    if (corners.size() >= grid.enough) return corners;
  }
  return search_cells(image, used, grid, room, kWeak);
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
