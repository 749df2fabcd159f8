// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "stereo_slam/io/output_file.hpp"
#include "stereo_slam/results/output.hpp"

namespace stereo_slam {

/// The results that are written frame by frame, so that every finished frame survives a kill:
/// trajectory_online.txt, covariances.csv (as known at the time of each frame), timing.csv and loops.csv.
/// All functions throw std::runtime_error when a file cannot be written.
class ResultStreams {
 public:
  /// Begins the files, in a folder that holds results only once there is a frame to replace them with.
  /// T_body_camera: write poses of the body.
  ResultStreams(std::filesystem::path folder, std::optional<Eigen::Isometry3d> T_body_camera);

  /// Whether the files of this run are there; before its first frame they may be those of another one.
  [[nodiscard]] bool begun() const { return begun_; }

  /// Appends the last frame of the record.
  void append_frame(const RunRecord& record);

  /// Appends the loops that were not appended yet, of all loops so far; nothing if these are fewer.
  void append_loops(std::span<const LoopEvent> loops);

  /// Returns once the poses, covariances and loops appended so far are on the disk. Needs a frame; may run
  /// beside the other functions.
  void sync() noexcept;

 private:
  void begin();
  void append_timing(const RunRecord& record);

  std::filesystem::path folder_;
  std::optional<Eigen::Isometry3d> T_body_camera_;
  AppendFile online_;
  AppendFile covariances_;
  AppendFile timing_;
  AppendFile loops_;
  std::vector<std::string> stages_;  ///< columns of timing.csv
  std::size_t appended_loops_ = 0;
  bool begun_ = false;
};

}  // namespace stereo_slam
