// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <ostream>
#include <span>
#include <string_view>

#include "stereo_slam/app/run_options.hpp"
#include "stereo_slam/dataset/sequence.hpp"
#include "stereo_slam/results/run_summary.hpp"
#include "stereo_slam/settings/settings.hpp"

namespace stereo_slam {

/// Throws std::runtime_error unless the file of `run --json` can be written when the run has ended. It may
/// replace an earlier such file, but no input, no result of the run and not the map of --save-map.
void check_run_json(const std::filesystem::path& file, std::span<const std::filesystem::path> inputs,
                    const RunOptions& options);

/// Writes how a run went as one JSON object; docs/datasets.md lists its members.
void write_run_json(std::ostream& stream, const RunSummary& summary, const StereoSequence& sequence,
                    const Settings& settings);

}  // namespace stereo_slam
