// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <filesystem>
#include <numbers>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/evaluation/evaluate.hpp"
#include "stereo_slam/io/trajectory_io.hpp"

/// Precision and recall of the loops of a run.
namespace stereo_slam {

/// Reads loops.csv. Throws std::runtime_error that names file, line and error.
[[nodiscard]] std::vector<LoopEvent> read_loops(const std::filesystem::path& file);

/// Ground-truth T_world_camera of the frames of a run; nothing where the ground truth has no pose.
using TruePoses = std::vector<std::optional<Eigen::Isometry3d>>;

/// The ground-truth poses of `frames` estimates; `pairs` are (truth, estimate) indices of matched poses.
[[nodiscard]] TruePoses poses_at_frames(const Trajectory& truth, const FramePairs& pairs, std::size_t frames);

/// When a frame revisits a place: its pose is near the pose of a much earlier frame, and the camera was
/// elsewhere in between. A camera that stands still or moves very slowly does not revisit.
struct RevisitRule {
  double max_distance_m = 5.0;
  double max_angle_rad = std::numbers::pi / 6;
  std::size_t min_gap_frames = 60;  ///< as place_recognition.min_gap_frames
  double min_path_m = 10.0;         ///< path length since the earlier frame
  std::size_t max_hole_frames = 5;  ///< longer gaps divide a revisit in two
  /// This many frames after a loop count as found by it; as keyframes.max_frames, the largest distance of two
  /// keyframes.
  std::size_t reach_frames = 20;
  double max_true_error_m = 2.0;  ///< largest error of the relative pose of a true loop
  double max_true_error_rad = std::numbers::pi / 36;
};

/// Consecutive frames that revisit a place.
struct Revisit {
  std::size_t first = 0;
  std::size_t last = 0;
  double path_m = 0.0;                    ///< path length
  double found_path_m = 0.0;              ///< part of it within reach of a true accepted loop
  std::optional<std::size_t> first_loop;  ///< frame of the first such loop; nothing if missed
};

/// The revisits of a path, in order; their fields about loops are empty.
[[nodiscard]] std::vector<Revisit> find_revisits(const TruePoses& truth, const RevisitRule& rule);

struct LoopScore {
  std::vector<Revisit> revisits;
  std::size_t accepted = 0;
  std::size_t accepted_false = 0;
  std::size_t refused = 0;
  std::size_t refused_true = 0;
  /// Loops, accepted or refused, that cannot be judged: a frame has no ground truth, or is in a loaded map.
  std::size_t without_truth = 0;
};

/// Scores the loops. A loop is true if its relative pose agrees with the ground truth, however far apart the
/// two views are. Loops and ground truth must be of the same frame, camera or body. Throws
/// std::runtime_error when a loop has a frame that the run does not have.
[[nodiscard]] LoopScore score_loops(const TruePoses& truth, const std::vector<LoopEvent>& loops,
                                    const RevisitRule& rule = {});

/// Revisits with a true accepted loop.
[[nodiscard]] std::size_t revisits_found(const LoopScore& score);

/// Share of the path of all revisits that lies within reach of a true accepted loop; nothing without a path.
[[nodiscard]] std::optional<double> path_recall(const LoopScore& score);

/// Median number of frames from the beginning of a found revisit to its first loop; nothing if none was
/// found.
[[nodiscard]] std::optional<double> median_delay_frames(const LoopScore& score);

/// As text.
void print_loop_score(std::ostream& stream, const LoopScore& score);

/// As a JSON object; figures that do not exist are null.
[[nodiscard]] std::string loop_score_json(const LoopScore& score);

}  // namespace stereo_slam
