// SPDX-License-Identifier: MIT
#pragma once

#include <ostream>
#include <string>
#include <vector>

#include "stereo_slam/io/trajectory_io.hpp"
#include "stereo_slam/report/thumbnails.hpp"
#include "stereo_slam/results/output.hpp"
#include "stereo_slam/results/run_yaml.hpp"

namespace stereo_slam::report {

/// What the report contains besides the record of the run.
struct RunInfo {
  RunHeader header;
  std::string dataset;  ///< folder
  std::string preset;
  Trajectory ground_truth = {};  ///< of the camera, with stamps; without poses if the recording has none
  std::vector<Thumbnail> thumbnails = {};
};

/// Writes a self-contained HTML page about a run: key figures, the path and the map in three dimensions,
/// charts over time, images, loops. The poses of the record must be those of the camera; the record may be
/// empty. At most 5000 frames are shown; see shown_frames() for longer runs.
void write_report(std::ostream& stream, const RunRecord& record, const RunInfo& info);

}  // namespace stereo_slam::report
