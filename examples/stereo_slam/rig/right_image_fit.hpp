// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "stereo_slam/core/median.hpp"

namespace stereo_slam {

/// Where the search for a point in a stereo pair succeeded.
struct PairSearch {
  bool in_left = false;
  std::optional<double> row_error_px;  ///< left minus right row, corrected; nothing if not in the right image
};

/// How well the right image fits the left one: whether it shows the same points, at the same heights.
struct RightImageFit {
  std::size_t in_left = 0;     ///< points found in the left image
  std::size_t in_right = 0;    ///< those of them that were found in the right image, too
  double row_spread_px = 0.0;  ///< median absolute deviation of the latter's row errors from their median
};

[[nodiscard]] inline RightImageFit fit_of(const std::vector<PairSearch>& searches) {
  RightImageFit fit;
  std::vector<double> row_errors_px;
  row_errors_px.reserve(searches.size());
  for (const auto& search : searches) {
    if (search.in_left) ++fit.in_left;
    if (search.row_error_px) row_errors_px.push_back(*search.row_error_px);
  }
  fit.in_right = row_errors_px.size();
  const double middle_px = median(row_errors_px);
  for (double& error : row_errors_px) error = std::abs(error - middle_px);
  fit.row_spread_px = median(std::move(row_errors_px));
  return fit;
}

}  // namespace stereo_slam
