// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <ostream>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "stereo_slam/io/trajectory_io.hpp"
#include "stereo_slam/report/run_folder.hpp"

namespace stereo_slam::report {

/// The ground truth that all runs are compared with.
struct ComparisonTruth {
  Trajectory trajectory;
  double max_difference_s = 0.01;  ///< of the stamps of matched poses
};

/// The data that page/compare.js shows.
[[nodiscard]] nlohmann::json comparison_data(const std::vector<RunFolder>& runs,
                                             const std::optional<ComparisonTruth>& truth);

/// Writes a self-contained HTML page that compares runs: their paths in one view, their errors if there is a
/// ground truth, their costs, and the settings in which they differ.
void write_comparison(std::ostream& stream, const std::vector<RunFolder>& runs,
                      const std::optional<ComparisonTruth>& truth);

}  // namespace stereo_slam::report
