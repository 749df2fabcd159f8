// SPDX-License-Identifier: MIT
#include "stereo_slam/frontend/spatial_index.hpp"

#include <algorithm>
#include <cmath>

namespace stereo_slam {

SpatialIndex::SpatialIndex(const std::vector<Vector2<double>>& points_px, cv::Size image)
    : points_px_(points_px),
      columns_(image.width / kCell_px + 1),
      rows_(image.height / kCell_px + 1),
      first_of_cell_(static_cast<std::size_t>(columns_ * rows_), kNone),
      next_in_cell_(points_px.size(), kNone) {
  for (std::size_t i = points_px_.size(); i-- > 0;) {
    const auto& p = points_px_[i];
    if (!(p.x() >= 0.0 && p.y() >= 0.0 && p.x() < image.width && p.y() < image.height)) continue;
    std::size_t& first = first_of_cell_[static_cast<std::size_t>(row(p.y()) * columns_ + column(p.x()))];
    next_in_cell_[i] = first;
    first = i;
  }
}

int SpatialIndex::column(double x) const {
  return static_cast<int>(std::clamp(x / kCell_px, 0.0, static_cast<double>(columns_ - 1)));
}

int SpatialIndex::row(double y) const {
  return static_cast<int>(std::clamp(y / kCell_px, 0.0, static_cast<double>(rows_ - 1)));
}

bool SpatialIndex::any_within(const Vector2<double>& centre_px, double radius_px) const {
  bool found = false;
  for_each_in_box(centre_px, Vector2<double>::Constant(radius_px), [&](std::size_t i) {
    found = found || (points_px_[i] - centre_px).squaredNorm() <= radius_px * radius_px;
  });
  return found;
}

std::vector<std::size_t> spread_over_buckets(const std::vector<Vector2<double>>& points_px, cv::Size image,
                                             int bucket_px, std::size_t count) {
  const int columns = image.width / bucket_px + 1;
  const int rows = image.height / bucket_px + 1;
  std::vector<std::vector<std::size_t>> buckets(static_cast<std::size_t>(columns * rows));
  for (std::size_t i = 0; i < points_px.size(); ++i) {
    const int column = std::clamp(static_cast<int>(points_px[i].x()) / bucket_px, 0, columns - 1);
    const int row = std::clamp(static_cast<int>(points_px[i].y()) / bucket_px, 0, rows - 1);
    buckets[static_cast<std::size_t>(row * columns + column)].push_back(i);
  }
  std::vector<std::size_t> chosen;
  count = std::min(count, points_px.size());
  for (std::size_t rank = 0; chosen.size() < count; ++rank) {
    std::vector<std::size_t> round;
    for (const auto& bucket : buckets) {
      if (rank < bucket.size()) round.push_back(bucket[rank]);
    }
    const std::size_t room = std::min(count - chosen.size(), round.size());
    for (std::size_t k = 0; k < room; ++k) chosen.push_back(round[k * round.size() / room]);
  }
  return chosen;
}

}  // namespace stereo_slam
