// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "stereo_slam/io/trajectory_io.hpp"

namespace stereo_slam::report {

/// The result files of a run. Vectors have one element a frame; missing values are NaN.
struct RunFolder {
  std::filesystem::path folder;
  /// run.yaml as text: "state", "host.processor", "settings.features.count" ...
  std::map<std::string, std::string> entries;
  std::string problem;          ///< why frames are missing; empty if none are
  Trajectory trajectory;        ///< final poses with stamps
  std::vector<double> sigma_m;  ///< root of the trace of the position's covariance
  std::vector<double> nis_per_dof;
  std::vector<double> total_ms;
  std::vector<double> resident_mb;
  std::size_t lost = 0;  ///< frames
  std::size_t accepted_loops = 0;

  /// An entry of run.yaml; empty if there is none.
  [[nodiscard]] std::string entry(const std::string& key) const;
  /// An entry of run.yaml as a number; NaN if it is not a number.
  [[nodiscard]] double number(const std::string& key) const;
};

/// Reads the output folder of `stereo_slam run`. A run that has not ended may lack files; then `problem` says
/// so. Throws std::runtime_error if there is no run.yaml or if a file is damaged.
[[nodiscard]] RunFolder read_run_folder(const std::filesystem::path& folder);

}  // namespace stereo_slam::report
