// SPDX-License-Identifier: MIT
#pragma once

#include <ostream>

#include "stereo_slam/results/output.hpp"

namespace stereo_slam::report {

/// What the report says of a run besides its record.
struct RunInfo {
  RunHeader header;
  std::string dataset;  ///< its folder
  std::string preset;
};

/// One HTML page about a run of the camera that needs no other file and no network: figures, path, charts
/// with what they mean, loops. A run of no frames has one, too.
void write_report(std::ostream& stream, const RunRecord& record, const RunInfo& info);

}  // namespace stereo_slam::report
