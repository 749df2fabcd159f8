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

/// The results that are written frame by frame, so that no finished frame is lost when the program is killed:
/// trajectory_online.txt, covariances.csv (as known at the time of each frame), timing.csv and loops.csv.
/// All functions except sync() throw std::runtime_error when a file cannot be written.
class ResultStreams {
 public:
  /// Creates the files in `folder`; if it holds earlier results, only when the first frame is appended, which
  /// replaces them. With `T_body_camera` the poses written are those of the body.
  ResultStreams(std::filesystem::path folder, std::optional<Eigen::Isometry3d> T_body_camera);

  /// Whether the files of this run exist; before the first frame, the folder may hold those of an earlier
  /// run.
  [[nodiscard]] bool begun() const { return begun_; }

  /// Appends the last frame of the record.
  void append_frame(const RunRecord& record);

  /// Takes all loops so far and appends those that were not appended yet.
  void append_loops(std::span<const LoopEvent> loops);

  /// Returns once the poses, covariances and loops appended so far are on the disk. Call it after the first
  /// append_frame(); it may run concurrently with the other functions.
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
