// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <limits>
#include <vector>

#include <opencv2/core.hpp>

#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// Points of an image in square cells, for searches within a radius. Points outside the image are ignored.
class SpatialIndex {
 public:
  SpatialIndex(const std::vector<Vector2<double>>& points_px, cv::Size image);

  /// Calls `visit(index)` for every point in the box around `centre_px`, by cell, then by index.
  template <class Visit>
  void for_each_in_box(const Vector2<double>& centre_px, const Vector2<double>& half_size_px,
                       Visit&& visit) const {
    const int first_column = column(centre_px.x() - half_size_px.x());
    const int last_column = column(centre_px.x() + half_size_px.x());
    const int first_row = row(centre_px.y() - half_size_px.y());
    const int last_row = row(centre_px.y() + half_size_px.y());
    for (int r = first_row; r <= last_row; ++r) {
      for (int c = first_column; c <= last_column; ++c) {
        for (std::size_t i = first_of_cell_[static_cast<std::size_t>(r * columns_ + c)]; i != kNone;
             i = next_in_cell_[i]) {
          const Vector2<double> offset = (points_px_[i] - centre_px).cwiseAbs();
          if (offset.x() <= half_size_px.x() && offset.y() <= half_size_px.y()) visit(i);
        }
      }
    }
  }

  /// Whether any point is within `radius_px` (Euclidean).
  [[nodiscard]] bool any_within(const Vector2<double>& centre_px, double radius_px) const;

 private:
  static constexpr int kCell_px = 16;
  static constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();

  [[nodiscard]] int column(double x) const;
  [[nodiscard]] int row(double y) const;

  std::vector<Vector2<double>> points_px_;
  int columns_;
  int rows_;
  std::vector<std::size_t> first_of_cell_;  ///< index of a point, or kNone
  std::vector<std::size_t> next_in_cell_;   ///< of each point: the next one in its cell, or kNone
};

/// Indices of at most `count` points: the first of every bucket, then the second of every bucket, and so on;
/// the last, incomplete round is taken evenly over the buckets. `points_px` is ordered by strength.
[[nodiscard]] std::vector<std::size_t> spread_over_buckets(const std::vector<Vector2<double>>& points_px,
                                                           cv::Size image, int bucket_px, std::size_t count);

}  // namespace stereo_slam
