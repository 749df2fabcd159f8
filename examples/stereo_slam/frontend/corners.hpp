// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <vector>

#include <opencv2/core.hpp>

#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

inline constexpr int kCornerBorder_px = 19;  ///< half the patch of a descriptor, rotated

/// How corners are spread over an image.
struct CornerGrid {
  int cell_px = 40;
  int per_cell = 2;              ///< corners a cell, with those present
  double min_distance_px = 4.0;  ///< between corners, and to the points already there
  std::size_t enough = 0;        ///< with fewer strong corners than this, weak ones are taken too
  bool fill_empty_cells = true;  ///< even if there are enough, take weaker ones in cells without a clear one
};

/// FAST corners of a grey image in the cells that are less than half full with `present_px`, away from these
/// and from `reserved_px`: in every such cell those with the largest smallest eigenvalue of the structure
/// tensor (Shi and Tomasi 1994), which is their response. Weaker corners are taken everywhere if there are
/// not enough, and otherwise only in cells without a clear one, if these are to be filled. They have no
/// descriptors. None is nearer than kCornerBorder_px to the border, so that each can be described.
[[nodiscard]] std::vector<Feature> detect_corners(const cv::Mat& image,
                                                  const std::vector<Vector2<double>>& present_px,
                                                  const std::vector<Vector2<double>>& reserved_px,
                                                  const CornerGrid& grid);

/// ORB descriptors of points of a grey image, one a point, at full resolution and along the orientation of
/// the patch (Rublee et al. 2011). Points nearer than kCornerBorder_px to the border have
/// zeros.
[[nodiscard]] std::vector<Descriptor> describe_points(const cv::Mat& image,
                                                      const std::vector<Vector2<double>>& points_px);

}  // namespace stereo_slam
