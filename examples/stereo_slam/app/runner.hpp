// SPDX-License-Identifier: MIT
#pragma once

#include "stereo_slam/app/run_options.hpp"
#include "stereo_slam/dataset/sequence.hpp"
#include "stereo_slam/results/run_summary.hpp"
#include "stereo_slam/settings/settings.hpp"

namespace stereo_slam {

/// Runs the SLAM on a recording and writes the results. Another thread reads images ahead. Each frame is
/// appended to the result files before the next one begins. SIGINT, SIGTERM and SIGHUP end the run after the
/// current frame; the frames before a signal or an error are saved. The results do not depend on the number
/// of threads; with `realtime` they depend on the speed of the machine. Throws std::runtime_error when the
/// run cannot start: the output or the map file cannot be used, `pose_frame` is the body and the calibration
/// has no body frame, or `realtime` is set and the stamps do not increase or have a gap of more than ten
/// minutes.
[[nodiscard]] RunSummary run(const StereoSequence& sequence, const Settings& settings,
                             const RunOptions& options);

}  // namespace stereo_slam
