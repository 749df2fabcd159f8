// SPDX-License-Identifier: MIT
#pragma once

#include "stereo_slam/report/line_chart.hpp"
#include "stereo_slam/results/output.hpp"

/// The charts of a run; the record has poses of the camera.
namespace stereo_slam::report {

/// Height above the first camera over the path length, with one standard deviation.
[[nodiscard]] LineChart height_chart(const RunRecord& record);

/// Standard deviations of the final poses along and about the camera's axes.
[[nodiscard]] LineChart position_sigma_chart(const RunRecord& record);
[[nodiscard]] LineChart rotation_sigma_chart(const RunRecord& record);

/// Milliseconds per frame, by stage and in total.
[[nodiscard]] LineChart time_chart(const RunRecord& record);

[[nodiscard]] LineChart memory_chart(const RunRecord& record);

/// Features, landmarks and matches.
[[nodiscard]] LineChart count_chart(const RunRecord& record);

/// Normalised innovation squared of the pose update per degree of freedom.
[[nodiscard]] LineChart innovation_chart(const RunRecord& record);

}  // namespace stereo_slam::report
