// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/evaluation/evaluate.hpp"
#include "stereo_slam/io/trajectory_io.hpp"

/// Compares the covariances of a run with its errors (NEES) and its innovations (NIS).
namespace stereo_slam {

/// A frame's row of covariances.csv.
struct CovarianceRow {
  std::size_t keyframe = 0;  ///< row of the keyframe that the frame was estimated relative to
  Matrix6<double> relative;  ///< covariance of T_keyframe_frame, without the errors of `calibration`
  double nis = 0.0;          ///< normalised innovation squared of the pose update
  int nis_dof = 0;           ///< its degrees of freedom; 0: no update
  CalibrationError calibration{};
  Matrix6<double> in_world = Matrix6<double>::Zero();   ///< covariance of T_world_frame; zero: not known
  std::optional<std::int64_t> stamp_ns = std::nullopt;  ///< nothing: not known
};

/// Whether two stamps can be of the same frame: they differ by at most a microsecond, since other programs
/// write stamps as floating-point numbers.
[[nodiscard]] bool is_same_stamp(std::int64_t a_ns, std::int64_t b_ns);

/// Reads covariances.csv, one row a frame. Throws std::runtime_error naming file, line and what was wrong.
[[nodiscard]] std::vector<CovarianceRow> read_covariances(const std::filesystem::path& file);

/// Errors of the ground truth itself: standard deviations of a relative pose, per axis.
struct GroundTruthNoise {
  double translation_m = 0.0;
  double rotation_rad = 0.0;
};

/// The frames of a run, one element each.
struct TrackedRun {
  std::vector<CovarianceRow> rows;
  std::vector<Pose> poses;                      ///< T_world_camera, as known at the end
  std::vector<std::optional<Pose>> true_poses;  ///< in any world; nothing where the ground truth has none
};

/// Normalised estimation error squared (NEES) of the pose of frame `to` relative to frame `from`.
struct FrameNees {
  std::size_t from = 0;
  std::size_t to = 0;
  double value = 0.0;
};

/// The NEES of the poses of the frames k + `frames` relative to the frames k, for every k that is a keyframe,
/// in order. The covariance of a relative pose is composed over the keyframes between. Throws
/// std::runtime_error when a covariance is not positive definite.
[[nodiscard]] std::vector<FrameNees> relative_nees(const TrackedRun& run, std::size_t frames,
                                                   const GroundTruthNoise& noise);

/// The NEES of the poses in the world, in order: of the final poses, with loop closure, relative to the frame
/// that began the map, which usually is the first one. Empty if that frame has no ground truth, or if it is
/// not the origin of the world because the run continues in a loaded map.
[[nodiscard]] std::vector<FrameNees> world_nees(const TrackedRun& run, const GroundTruthNoise& noise);

/// Scores of the NEES of some poses.
struct NeesScore {
  std::size_t count = 0;      ///< of poses; all figures are zero without poses
  double mean = 0.0;          ///< 6 if the covariances are right
  double median = 0.0;        ///< 5.35 if the covariances are right
  double share_inside = 0.0;  ///< share of the poses inside the 95 % bound, 12.59
};

/// Scores of the NEES of relative poses over a number of frames.
struct RelativeNees : NeesScore {
  std::size_t frames = 0;
};

struct NeesReport {
  std::vector<RelativeNees> relative;  ///< over 1, 10 and 100 frames
  NeesScore in_world;                  ///< of all frames, relative to the first
  std::size_t updates = 0;             ///< pose updates with measurements
  double mean_nis_per_dof = 0.0;       ///< 1 if the measurement noise is as assumed
  double median_nis_per_dof = 0.0;
  bool truth_taken_as_exact = false;  ///< the noise of the ground truth was zero
};

/// Scores the covariances. `pairs` are (truth, estimate) indices of matched poses, in order; row i belongs to
/// estimate i. Each relative pose starts at a keyframe; its covariance is composed over the keyframes up to
/// its last frame. Throws std::runtime_error when rows and estimate differ in number, or in a stamp.
[[nodiscard]] NeesReport score_covariances(const Trajectory& truth, const Trajectory& estimate,
                                           const FramePairs& pairs, const std::vector<CovarianceRow>& rows,
                                           const GroundTruthNoise& noise);

/// As text.
void print_nees(std::ostream& stream, const NeesReport& report);

/// As a JSON object.
[[nodiscard]] std::string nees_json(const NeesReport& report);

}  // namespace stereo_slam
