// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "stereo_slam/results/run_summary.hpp"

namespace stereo_slam {

/// What the user should know of the cameras after a run: where images or calibration are not as they should
/// be.
[[nodiscard]] std::vector<std::string> camera_warnings(const RunSummary& summary);

}  // namespace stereo_slam
