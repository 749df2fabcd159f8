// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <ostream>
#include <span>
#include <string>
#include <vector>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/dataset/sequence.hpp"
#include "stereo_slam/results/learned_cameras.hpp"

/// Writes the result files at the end of a run, each completely or not at all. result_streams.hpp writes
/// files during the run.
namespace stereo_slam {

/// What `run --realtime` records of a frame that it processed.
struct RealtimeFrame {
  double latency_ms = 0.0;               ///< from the time the frame was offered to its result
  std::vector<std::int64_t> dropped_ns;  ///< stamps of the frames dropped since the previous processed one
};

/// A run at the pace of the recording's stamps.
struct RealtimeRecord {
  std::vector<RealtimeFrame> frames;  ///< one a processed frame
  double reading_delay_s = 0.0;       ///< by how much the last frame was offered late because of slow reading
};

/// An image that could not be read, which the run treated as missing.
struct UnreadableImage {
  std::size_t frame = 0;
  std::string fault;  ///< its file, or its source and index, and what is wrong with it
};

/// Results of the frames processed so far.
struct RunRecord {
  std::vector<FrameResult> results;      ///< of each frame, as known when it was processed
  std::vector<double> total_ms;          ///< of processing each frame
  std::vector<double> cpu_ms;            ///< CPU time of the whole process since the frame before
  std::vector<double> read_cpu_ms;       ///< CPU time of reading each frame, ahead of its turn
  std::vector<double> resident_mb;       ///< memory of the process after each frame; NaN where unknown
  std::vector<PoseGaussian> trajectory;  ///< final T_world_camera, one a frame
  std::vector<MapPoint> map_points;
  std::vector<LoopEvent> loops;
  std::vector<UnreadableImage> unreadable;
  RigSummary rig{};                                        ///< as learned at the end
  std::optional<InertialSummary> inertial = std::nullopt;  ///< nothing without an IMU
  std::optional<RealtimeRecord> realtime = std::nullopt;
};

/// Number of frames with a property.
[[nodiscard]] std::size_t count_frames(const RunRecord& record,
                                       const std::function<bool(const FrameResult&)>& property);

/// How many frames have each of kWeakReasons, in the same order. A frame may have several.
using ReasonCounts = std::array<std::size_t, kWeakReasons.size()>;

/// Of the frames with a status.
[[nodiscard]] ReasonCounts count_reasons(const RunRecord& record, TrackingStatus status);

/// Cost per frame. median, p95 and max are of the processing time without reading the images; CPU times are
/// means over the frames, of all threads of the process.
struct FrameCost {
  double median_ms = 0.0;
  double p95_ms = 0.0;
  double max_ms = 0.0;
  double cpu_ms = 0.0;       ///< with reading the images
  double read_cpu_ms = 0.0;  ///< reading the images; part of cpu_ms
};

/// All zero without frames.
[[nodiscard]] FrameCost frame_cost(const RunRecord& record);

/// How a run kept up with the stamps.
struct RealtimeSummary {
  std::size_t dropped = 0;  ///< frames
  double median_ms = 0.0;   ///< latency
  double p95_ms = 0.0;
  double max_ms = 0.0;
  double reading_delay_s = 0.0;
};

/// Nothing for a run without --realtime.
[[nodiscard]] std::optional<RealtimeSummary> realtime_summary(const RunRecord& record);

/// The final poses of all frames up to the last processed one. The pose of a dropped frame is interpolated by
/// its stamp between the processed frames before and after, with constant velocity along the screw motion
/// (ScLERP); frames dropped before the first processed frame have the pose of that frame.
[[nodiscard]] std::vector<Pose> poses_of_all_frames(const RunRecord& record);

/// Writes trajectory_kitti.txt, trajectory_tum.txt, trajectory_online.txt, covariances.csv, timing.csv,
/// loops.csv, map.ply, cameras.yaml if something was learned, and inertial.csv if there is an IMU.
/// trajectory_kitti.txt has poses_of_all_frames, as that format has no stamps; the others have processed
/// frames only. If a file cannot be written, the others are still written; then std::runtime_error is thrown
/// with the first failure.
void write_results(const std::filesystem::path& folder, const RunRecord& record);

/// The files that a run writes, besides run.yaml.
[[nodiscard]] std::span<const char* const> result_files();

/// Writes one line per frame: stamp, status and the upper triangle of the 6x6 covariance of xi in
/// T_world_camera = mean * exp(xi); then keyframe, NIS, the errors that all frames share, the covariance
/// relative to the keyframe, and the names of WeakReasons that hold, whatever the status is.
void write_covariances(std::ostream& stream, const RunRecord& record);
void write_covariances_header(std::ostream& stream);
/// The line of a frame; `covariance` is that of T_world_camera.
void write_covariances_row(std::ostream& stream, const FrameResult& result,
                           const Matrix6<double>& covariance);

/// Names of all stages, in order of first appearance.
[[nodiscard]] std::vector<std::string> stage_names(const RunRecord& record);

/// Milliseconds a frame spent in a stage.
[[nodiscard]] double stage_ms(const FrameResult& result, const std::string& stage);

/// Writes one line per frame: milliseconds of every stage (columns in the order of stage_names) and in total;
/// CPU milliseconds of the whole process since the line before, which include the thread that reads later
/// frames; CPU milliseconds that reading this frame took; and megabytes of resident memory, empty where
/// unknown. With --realtime also the latency, in milliseconds from the time the frame was offered to its
/// result, and the number of frames dropped before it.
void write_timing(std::ostream& stream, const RunRecord& record);
/// The line of frame `k` of the record.
void write_timing_row(std::ostream& stream, const RunRecord& record, std::size_t k,
                      const std::vector<std::string>& stages);

/// Writes one line per loop: its frames, inliers, chi2, verdict and relative pose.
void write_loops(std::ostream& stream, std::span<const LoopEvent> loops);
void write_loops_header(std::ostream& stream);
void write_loops_row(std::ostream& stream, const LoopEvent& loop);

/// Writes a binary PLY of points with grey colours, readable by MeshLab and CloudCompare.
void write_ply(std::ostream& stream, std::span<const MapPoint> points);

}  // namespace stereo_slam
