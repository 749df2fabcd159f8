// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <memory>
#include <optional>

#include "stereo_slam/app/run_options.hpp"
#include "stereo_slam/dataset/sequence.hpp"
#include "stereo_slam/io/output_file.hpp"
#include "stereo_slam/results/map_file.hpp"
#include "stereo_slam/ros2_output/mcap_file.hpp"
#include "stereo_slam/settings/settings.hpp"
#include "stereo_slam/slam/slam_system.hpp"

/// The files of a run besides its folder of results: --load-map, --save-map and --mcap.
namespace stereo_slam {

/// Throws std::runtime_error unless the run keeps keyframes, of which saved maps consist: only loop closure
/// keeps them.
void require_keyframes(const Settings& settings);

/// Throws unless --save-map can be written at the end of the run, and replaces nothing but an earlier map.
void check_save_map(const RunOptions& options);

/// What --mcap asks for. Throws unless its file can be written during the run, see check_mcap().
[[nodiscard]] std::optional<McapOptions> checked_mcap(const RunOptions& options);

/// Writes the map of --save-map. An `earlier` map is replaced only if the run has `finished`; otherwise the
/// new one is written beside it, unless it is empty, and the name of its file is returned. If another file
/// took the place of the map during the run, such as the map of a second run, the map is written beside that,
/// and std::runtime_error names both.
[[nodiscard]] std::optional<std::filesystem::path> write_map(const RunOptions& options, const SavedMap& map,
                                                             bool finished, const EarlierFile& earlier);

/// The SLAM, with the map of --load-map if there is one. Errors of the map name its file.
[[nodiscard]] std::unique_ptr<SlamSystem> make_slam(const StereoSequence& sequence, const Settings& settings,
                                                    const RunOptions& options);

}  // namespace stereo_slam
