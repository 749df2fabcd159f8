// SPDX-License-Identifier: MIT
#pragma once

#include "stereo_slam/app/run_options.hpp"
#include "stereo_slam/dataset/sequence.hpp"
#include "stereo_slam/results/map_file.hpp"
#include "stereo_slam/settings/settings.hpp"
#include "stereo_slam/slam/slam.hpp"

/// The map files of a run: --load-map and --save-map.
namespace stereo_slam {

/// Throws std::runtime_error unless the run keeps keyframes, of which saved maps consist: only loop closure
/// in the anchored layout keeps them.
void require_keyframes(const Settings& settings);

/// Throws unless --save-map can be written at the end of the run, and replaces nothing but an earlier map.
void check_save_map(const RunOptions& options);

/// Writes the map of --save-map. If its place was taken by another file during the run, writes it beside that
/// file and throws std::runtime_error, which names both.
void write_map(const RunOptions& options, const SavedMap& map);

/// The SLAM, with the map of --load-map if there is one. Errors of the map name its file.
[[nodiscard]] Slam make_slam(const StereoSequence& sequence, const Settings& settings,
                             const RunOptions& options);

}  // namespace stereo_slam
