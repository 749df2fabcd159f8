// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <vector>

#include <opencv2/core.hpp>

#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// How corners are spread over an image.
struct CornerGrid {
  int cell_px = 40;
  int per_cell = 2;              ///< corners per cell, including the points already there
  double min_distance_px = 4.0;  ///< between corners, and to the points already there
  std::size_t enough = 0;        ///< if fewer clear corners than this are found, weaker ones are taken too
  bool fill_empty_cells = true;  ///< even if there are enough, take weaker ones in cells without a clear one
};

/// FAST corners of a grey image (CV_8UC1), away from each other and from points that are already there.
///
/// New corners are searched in the cells that are less than half full with `present_px`, away from these
/// points and from `reserved_px`, all in px. Each of these cells gets the corners with the largest response:
/// the smaller eigenvalue of the structure tensor, grey levels^2 (Shi and Tomasi 1994). Cells without a clear
/// corner get weaker ones if fewer than grid.enough clear corners were found, or if grid.fill_empty_cells is
/// set. If there are still not enough, weaker corners are taken in all of these cells. The corners have no
/// descriptors. None is nearer than kDescriptorReach_px to the image border, so that each can be described.
/// Ordered by cell within each strength; empty for an empty image.
[[nodiscard]] std::vector<Feature> detect_corners(const cv::Mat& image,
                                                  const std::vector<Vector2<double>>& present_px,
                                                  const std::vector<Vector2<double>>& reserved_px,
                                                  const CornerGrid& grid);

}  // namespace stereo_slam
