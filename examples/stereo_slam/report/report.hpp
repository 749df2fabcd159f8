// SPDX-License-Identifier: MIT
#pragma once

#include <ostream>

#include "stereo_slam/results/output.hpp"

namespace stereo_slam::report {

/// What the report contains besides the record of the run.
struct RunInfo {
  RunHeader header;
  std::string dataset;  ///< folder
  std::string preset;
};

/// Writes a self-contained HTML page about a run: key figures, path, charts with explanations, loops. The
/// record has poses of the camera; it may have no frames.
void write_report(std::ostream& stream, const RunRecord& record, const RunInfo& info);

}  // namespace stereo_slam::report
