// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <limits>
#include <ostream>
#include <span>
#include <string>
#include <vector>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/dataset/sequence.hpp"
#include "stereo_slam/settings/settings.hpp"

/// The files a run leaves behind. Each is written whole or not at all.
namespace stereo_slam {

/// Everything that is known of the frames processed so far.
struct RunRecord {
  std::vector<FrameResult> results;      ///< as known when each frame was processed
  std::vector<double> total_ms;          ///< of processing each frame
  std::vector<double> resident_mb;       ///< memory of the process after each frame; NaN where unknown
  std::vector<PoseGaussian> trajectory;  ///< as known at the end, one a frame
  std::vector<MapPoint> map_points;
  std::vector<LoopEvent> loops;
};

/// What run.yaml says besides the settings.
struct RunHeader {
  std::string state;  ///< running, finished, interrupted or failed
  std::string error;  ///< empty unless failed
  std::size_t frames_processed = 0;
  double seconds = 0.0;
  std::string pose_frame = "camera";  ///< whose poses the trajectories hold, or "body"
  double peak_mb = std::numeric_limits<double>::quiet_NaN();  ///< memory of the process; NaN where unknown
  std::size_t bytes_per_keyframe = 0;                         ///< that loop closure keeps; zero without it
};

/// Creates the folder and removes the results of an earlier run from it. Throws std::runtime_error when that
/// fails.
void prepare_output_folder(const std::filesystem::path& folder);

/// trajectory_kitti.txt, trajectory_tum.txt, trajectory_online.txt, covariances.csv, timing.csv, loops.csv,
/// map.ply.
void write_results(const std::filesystem::path& folder, const RunRecord& record);

/// run.yaml: version, state, dataset, host and all settings; load_settings reads it.
void write_run_yaml(const std::filesystem::path& folder, const RunHeader& header,
                    const StereoSequence& sequence, const Settings& settings);

/// One line a frame: stamp, status, upper triangle of the 6x6 covariance of xi in T_world_camera = mean *
/// exp(xi).
void write_covariances(std::ostream& stream, const RunRecord& record);

/// Stages of any frame, in order of first appearance.
[[nodiscard]] std::vector<std::string> stage_names(const RunRecord& record);

/// Milliseconds a frame spent in a stage.
[[nodiscard]] double stage_ms(const FrameResult& result, const std::string& stage);

/// One line a frame: milliseconds of every stage (columns in order of first appearance) and in total,
/// megabytes of resident memory, empty where unknown.
void write_timing(std::ostream& stream, const RunRecord& record);

/// One line a loop: its frames, what speaks for it, and whether it was accepted.
void write_loops(std::ostream& stream, const RunRecord& record);

/// Binary PLY of points with grey colours, readable by MeshLab and CloudCompare.
void write_ply(std::ostream& stream, std::span<const MapPoint> points);

}  // namespace stereo_slam
