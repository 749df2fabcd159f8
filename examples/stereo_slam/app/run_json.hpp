// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <vector>

#include "stereo_slam/app/run_options.hpp"
#include "stereo_slam/dataset/sequence.hpp"
#include "stereo_slam/io/output_file.hpp"
#include "stereo_slam/results/run_summary.hpp"
#include "stereo_slam/settings/settings.hpp"

namespace stereo_slam {

/// The file of `run --json`, for how a run went.
class RunJson {
 public:
  /// Throws std::runtime_error unless the file can be written when the run has ended. It may replace an
  /// earlier such file, but none of `inputs`, no result of the run and not the map of --save-map. `options`
  /// must outlive the object.
  RunJson(std::filesystem::path file, std::vector<std::filesystem::path> inputs, const RunOptions& options);

  /// Writes one JSON object; docs/datasets.md lists its members. If another file took the place of the file
  /// during the run, it is written beside that, and std::runtime_error names both.
  void write(const RunSummary& summary, const StereoSequence& sequence, const Settings& settings) const;

 private:
  void check() const;

  std::filesystem::path file_;
  std::vector<std::filesystem::path> inputs_;
  const RunOptions& options_;
  EarlierFile earlier_;
};

}  // namespace stereo_slam
