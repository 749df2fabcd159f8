// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/report/report.hpp"
#include "stereo_slam/results/output.hpp"

namespace stereo_slam::report {

/// The data that page/run.js shows. `frames` has one array for each quantity, with an element (or three, or
/// four) for each shown frame; numbers that do not exist are null.
[[nodiscard]] nlohmann::json run_data(const RunRecord& record, const RunInfo& info);

/// Indices of at most `most` frames to show. The run is divided into groups of equally many consecutive
/// frames; of each group, the frame with the worst status is shown (the first, if several have it). The last
/// frame of the run is always shown.
[[nodiscard]] std::vector<std::size_t> shown_frames(std::span<const TrackingStatus> statuses,
                                                    std::size_t most);

}  // namespace stereo_slam::report
