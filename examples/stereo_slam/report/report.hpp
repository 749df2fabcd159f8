// SPDX-License-Identifier: MIT
#pragma once

#include <ostream>
#include <string>
#include <vector>

#include "stereo_slam/io/trajectory_io.hpp"
#include "stereo_slam/report/thumbnails.hpp"
#include "stereo_slam/results/output.hpp"

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
/// charts over time, images, loops. The record has poses of the camera; it may have no frames. At most 5000
/// frames are shown: of a longer run, the worst tracked of every few consecutive ones.
void write_report(std::ostream& stream, const RunRecord& record, const RunInfo& info);

}  // namespace stereo_slam::report
