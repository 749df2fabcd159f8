// SPDX-License-Identifier: MIT
#include "stereo_slam/frontend/corners.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "stereo_slam/core/parallel.hpp"
#include "stereo_slam/frontend/fast_corners.hpp"
#include "stereo_slam/frontend/features.hpp"
#include "stereo_slam/frontend/spatial_index.hpp"

namespace stereo_slam {
namespace {

constexpr int kExaminedPerCorner = 8;

/// Thresholds for a corner.
struct CornerStrength {
  int fast_threshold = 0;       ///< grey levels
  double min_eigenvalue = 0.0;  ///< grey levels^2
};

constexpr CornerStrength kClear{20, 2000.0};
constexpr CornerStrength kStrong{10, 2000.0};
constexpr CornerStrength kWeak{5, 900.0};  // hardly more than the alignment of patches needs

/// What to search for in the cells of an image.
struct CellSearch {
  CornerStrength strength;
  std::span<const int> wanted;  ///< number of corners, of each cell, row by row; 0: the cell is skipped
};

/// Number of cells in a row and in a column; the border of the image may cut the last ones.
[[nodiscard]] cv::Size cell_counts(cv::Size image, const CornerGrid& grid) {
  return {(image.width + grid.cell_px - 1) / grid.cell_px, (image.height + grid.cell_px - 1) / grid.cell_px};
}

/// Number of points in every cell, row by row. Points outside the image are not counted.
[[nodiscard]] std::vector<int> count_by_cell(const std::vector<Vector2<double>>& points_px, cv::Size image,
                                             const CornerGrid& grid) {
  const cv::Size cells = cell_counts(image, grid);
  std::vector<int> counts(static_cast<std::size_t>(cells.area()), 0);
  for (const auto& px : points_px) {
    const int column = static_cast<int>(std::floor(px.x() / grid.cell_px));
    const int row = static_cast<int>(std::floor(px.y() / grid.cell_px));
    if (column < 0 || row < 0 || column >= cells.width || row >= cells.height) continue;
    ++counts[static_cast<std::size_t>(row * cells.width + column)];
  }
  return counts;
}

/// Number of corners to add to every cell, row by row: grid.per_cell less the points present, and zero in
/// cells that are at least half full.
[[nodiscard]] std::vector<int> wanted_by_cell(const std::vector<Vector2<double>>& present_px, cv::Size image,
                                              const CornerGrid& grid) {
  std::vector<int> wanted = count_by_cell(present_px, image, grid);
  for (int& n : wanted) {
    const int missing = grid.per_cell - n;
    n = 2 * missing > grid.per_cell ? missing : 0;
  }
  return wanted;
}

/// The numbers of corners to add, without the cells in which corners were found.
[[nodiscard]] std::vector<int> wanted_in_empty_cells(std::vector<int> wanted,
                                                     const std::vector<int>& found_by_cell) {
  for (std::size_t cell = 0; cell < wanted.size(); ++cell) {
    if (found_by_cell[cell] > 0) wanted[cell] = 0;
  }
  return wanted;
}

/// The keypoints with the largest FAST scores, at most `count`; ties go by row. Reorders `keypoints`.
[[nodiscard]] std::span<const cv::KeyPoint> strongest_keypoints(std::vector<cv::KeyPoint>& keypoints,
                                                                std::size_t count) {
  count = std::min(count, keypoints.size());
  std::partial_sort(keypoints.begin(), keypoints.begin() + static_cast<std::ptrdiff_t>(count),
                    keypoints.end(), [](const cv::KeyPoint& a, const cv::KeyPoint& b) {
                      return a.response != b.response ? a.response > b.response
                                                      : std::pair(a.pt.y, a.pt.x) < std::pair(b.pt.y, b.pt.x);
                    });
  return {keypoints.data(), count};
}

/// The first `count` corners, or fewer, that are at least `min_distance_px` from those selected before.
[[nodiscard]] std::vector<Feature> select_spaced(const std::vector<Feature>& corners, double min_distance_px,
                                                 std::size_t count) {
  std::vector<Feature> taken;
  for (const auto& corner : corners) {
    if (taken.size() == count) break;
    const bool crowded = std::any_of(taken.begin(), taken.end(), [&](const Feature& other) {
      return (other.position_px - corner.position_px).norm() < min_distance_px;
    });
    if (!crowded) taken.push_back(corner);
  }
  return taken;
}

/// Search for corners in one row of cells.
class CellRow {
 public:
  CellRow(const cv::Mat& image, const CornerGrid& grid, const CellSearch& search, int row)
      : image_(image),
        grid_(grid),
        search_(search),
        part_(cv::Rect(0, row * grid.cell_px, image.cols, grid.cell_px) & corner_area(image.size())) {
    const auto columns = static_cast<std::size_t>(cell_counts(image.size(), grid).width);
    wanted_ = search.wanted.subspan(static_cast<std::size_t>(row) * columns, columns);
    keypoints_.resize(columns);
  }

  /// Finds the FAST corners of the cells.
  void find() {
    if (part_.empty()) return;
    for (std::size_t first = 0; first < wanted_.size(); ++first) {
      if (wanted_[first] <= 0) continue;
      std::size_t end = first + 1;
      while (end < wanted_.size() && wanted_[end] > 0) ++end;
      find_between(first, end);
      first = end;
    }
  }

  /// The best corners of every cell, away from the used points and each other.
  [[nodiscard]] std::vector<Feature> best(const SpatialIndex& used) {
    std::vector<Feature> corners;
    for (std::size_t cell = 0; cell < keypoints_.size(); ++cell) {
      for (auto& corner : best_of_cell(cell, used)) corners.push_back(std::move(corner));
    }
    return corners;
  }

 private:
  /// Finds the FAST corners of adjacent cells at once.
  void find_between(std::size_t first, std::size_t end) {
    const cv::Rect cells(static_cast<int>(first) * grid_.cell_px, part_.y,
                         static_cast<int>(end - first) * grid_.cell_px, part_.height);
    const cv::Rect inside = cells & part_;
    if (!inside.empty()) sort_into_cells(fast_corners(image_, inside, search_.strength.fast_threshold));
  }

  /// Puts the corners of this row into their cells. `corners` are ordered by rows.
  void sort_into_cells(const std::vector<cv::KeyPoint>& corners) {
    const auto above = [](const cv::KeyPoint& k, int y) { return k.pt.y < static_cast<float>(y); };
    const auto first = std::lower_bound(corners.begin(), corners.end(), part_.y, above);
    const auto end = std::lower_bound(first, corners.end(), part_.br().y, above);
    for (auto corner = first; corner != end; ++corner) {
      const auto cell = static_cast<std::size_t>(static_cast<int>(corner->pt.x) / grid_.cell_px);
      if (wanted_[cell] > 0) keypoints_[cell].push_back(*corner);
    }
  }

  /// The cell's corners with the largest response, as many as wanted.
  [[nodiscard]] std::vector<Feature> best_of_cell(std::size_t cell, const SpatialIndex& used) {
    // FAST's score is coarse; it decides only which corners are worth the structure tensor.
    const auto wanted = static_cast<std::size_t>(wanted_[cell]);
    std::vector<Feature> corners;
    for (const auto& keypoint : strongest_keypoints(keypoints_[cell], kExaminedPerCorner * wanted)) {
      const cv::Point at(static_cast<int>(keypoint.pt.x), static_cast<int>(keypoint.pt.y));
      Feature corner;
      corner.position_px = {static_cast<double>(at.x), static_cast<double>(at.y)};
      if (used.any_within(corner.position_px, grid_.min_distance_px)) continue;
      corner.response = smallest_eigenvalue(image_, at);
      if (corner.response >= search_.strength.min_eigenvalue) corners.push_back(corner);
    }
    std::stable_sort(corners.begin(), corners.end(),
                     [](const Feature& a, const Feature& b) { return a.response > b.response; });
    return select_spaced(corners, grid_.min_distance_px, wanted);
  }

  const cv::Mat& image_;
  const CornerGrid& grid_;
  const CellSearch& search_;
  cv::Rect part_;                                     // of the image, without its border
  std::span<const int> wanted_;                       // of each cell of the row
  std::vector<std::vector<cv::KeyPoint>> keypoints_;  // FAST corners of each cell
};

/// The corners without those that are nearer than `min_distance_px` to a stronger one, which is in another
/// cell: within a cell they are already apart.
[[nodiscard]] std::vector<Feature> without_crowded(const std::vector<Feature>& corners, cv::Size image,
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

/// The best corners of the cells, as many as wanted, away from the used points and each other.
[[nodiscard]] std::vector<Feature> search_cells(const cv::Mat& image, const SpatialIndex& used,
                                                const CornerGrid& grid, const CellSearch& search) {
  std::vector<std::vector<Feature>> by_row(static_cast<std::size_t>(cell_counts(image.size(), grid).height));
  run_each(by_row.size(), [&](std::size_t row) {
    CellRow cells(image, grid, search, static_cast<int>(row));
    cells.find();
    by_row[row] = cells.best(used);
  });
  std::vector<Feature> corners;
  for (const auto& row : by_row) corners.insert(corners.end(), row.begin(), row.end());
  return without_crowded(corners, image.size(), grid.min_distance_px);
}

/// The points of both lists.
[[nodiscard]] std::vector<Vector2<double>> joined(std::vector<Vector2<double>> points_px,
                                                  const std::vector<Vector2<double>>& more_px) {
  points_px.insert(points_px.end(), more_px.begin(), more_px.end());
  return points_px;
}

}  // namespace

std::vector<Feature> detect_corners(const cv::Mat& image, const std::vector<Vector2<double>>& present_px,
                                    const std::vector<Vector2<double>>& reserved_px, const CornerGrid& grid) {
  if (image.empty()) return {};
  const cv::Size size = image.size();
  const auto wanted = wanted_by_cell(present_px, size, grid);
  const auto used_px = joined(present_px, reserved_px);
  const SpatialIndex used(used_px, size);
  auto corners = search_cells(image, used, grid, {kClear, wanted});
  if (!grid.fill_empty_cells && corners.size() >= grid.enough) return corners;

  // FAST takes longer the lower its threshold: at first it is lowered only in cells that remained empty.
  for (const CornerStrength& strength : {kStrong, kWeak}) {
    const auto found_px = positions(corners);
    const auto wanted_in_empty = wanted_in_empty_cells(wanted, count_by_cell(found_px, size, grid));
    const SpatialIndex used_and_found(joined(used_px, found_px), size);
    const auto weaker = search_cells(image, used_and_found, grid, {strength, wanted_in_empty});
    corners.insert(corners.end(), weaker.begin(), weaker.end());
    if (corners.size() >= grid.enough) return corners;
  }
  return search_cells(image, used, grid, {kWeak, wanted});
}

}  // namespace stereo_slam
