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

/// Whether the loops of a run are true, and which of the places seen again they found.
namespace stereo_slam {

/// Reads loops.csv. Throws std::runtime_error naming file, line and what was wrong.
[[nodiscard]] std::vector<LoopEvent> read_loops(const std::filesystem::path& file);

/// True T_world_camera of the frames of a run; nothing where the truth has no pose.
using TruePoses = std::vector<std::optional<Eigen::Isometry3d>>;

/// The true poses of `frames` estimates; `pairs` are (truth, estimate) indices of the same instants.
[[nodiscard]] TruePoses poses_at_frames(const Trajectory& truth, const FramePairs& pairs, std::size_t frames);

/// When a frame sees a place again: it is this near to a frame this much earlier, and the camera has been
/// elsewhere in between, which neither standing nor creeping is.
struct RevisitRule {
  double max_distance_m = 5.0;
  double max_angle_rad = std::numbers::pi / 6;
  std::size_t min_gap_frames = 60;  ///< as place_recognition.min_gap_frames
  double min_path_m = 10.0;         ///< driven since
  std::size_t max_hole_frames = 5;  ///< longer ones divide a revisit in two
  std::size_t reach_frames = 20;    ///< after a loop that count as found by it: one keyframe's at most
  double max_loop_error_m = 2.0;    ///< of the relative pose that a true loop measures
  double max_loop_error_rad = std::numbers::pi / 36;
};

/// Frames in a row that see places again.
struct Revisit {
  std::size_t first = 0;
  std::size_t last = 0;
  double path_m = 0.0;                    ///< of the camera
  double found_path_m = 0.0;              ///< of it, within reach of a true accepted loop
  std::optional<std::size_t> first_loop;  ///< frame of the first such loop, or missed
};

/// The parts of a drive that see places again, in order; fields about loops are empty.
[[nodiscard]] std::vector<Revisit> find_revisits(const TruePoses& truth, const RevisitRule& rule);

struct LoopScore {
  std::vector<Revisit> revisits;
  std::size_t accepted = 0;
  std::size_t accepted_false = 0;
  std::size_t refused = 0;
  std::size_t refused_true = 0;
  std::size_t without_truth = 0;  ///< of either verdict; those with a loaded map, too
};

/// Judges the loops by the relative poses that they measure: how far apart the two views are is no fault of
/// a loop. Poses of loops and truth are in the same frame, of camera or body. Throws std::runtime_error when
/// a loop is of a frame that the run does not have.
[[nodiscard]] LoopScore score_loops(const TruePoses& truth, const std::vector<LoopEvent>& loops,
                                    const RevisitRule& rule = {});

/// Revisits with a true accepted loop.
[[nodiscard]] std::size_t revisits_found(const LoopScore& score);

/// Share of the path of all revisits that lies within reach of a true accepted loop; nothing without a path.
[[nodiscard]] std::optional<double> path_recall(const LoopScore& score);

/// Median number of frames from the beginning of a found revisit to its first loop; nothing if none is found.
[[nodiscard]] std::optional<double> median_delay_frames(const LoopScore& score);

/// For people.
void print_loop_score(std::ostream& stream, const LoopScore& score);

/// For programs: one object; figures that do not exist are null.
[[nodiscard]] std::string loop_score_json(const LoopScore& score);

}  // namespace stereo_slam
