// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <filesystem>
#include <ostream>
#include <string>
#include <vector>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/evaluation/evaluate.hpp"
#include "stereo_slam/io/trajectory_io.hpp"

/// Whether the covariances of a run are as large as its errors.
namespace stereo_slam {

/// A frame's row of covariances.csv.
struct CovarianceRow {
  std::size_t keyframe = 0;  ///< row of the frame it was estimated relative to
  Matrix6<double> relative;  ///< covariance of T_keyframe_frame, without the calibration's errors
  double nis = 0.0;
  int nis_dof = 0;
  CalibrationError calibration{};
};

/// Reads covariances.csv, one row a frame. Throws std::runtime_error naming file, line and what was wrong.
[[nodiscard]] std::vector<CovarianceRow> read_covariances(const std::filesystem::path& file);

/// Errors of the ground truth itself: standard deviations per axis of a relative pose.
struct TruthNoise {
  double translation_m = 0.0;
  double rotation_rad = 0.0;
};

/// Normalised estimation errors squared of relative poses over a number of frames.
struct RelativeNees {
  std::size_t frames = 0;
  std::size_t count = 0;
  double mean = 0.0;          ///< 6 if the covariances are honest
  double median = 0.0;        ///< 5.35
  double share_inside = 0.0;  ///< of the 95 % bound, 12.59
};

struct Consistency {
  std::vector<RelativeNees> relative;  ///< over 1, 10 and 100 frames
  std::size_t updates = 0;             ///< of the pose, with an innovation
  double mean_nis_per_dof = 0.0;       ///< 1 if the noise is as assumed
  double median_nis_per_dof = 0.0;
  bool truth_taken_as_exact = false;  ///< no noise of the ground truth was allowed for
};

/// Scores the covariances. `pairs` are (truth, estimate) indices of the same instants, in order; row i
/// belongs to estimate i. A relative pose starts at a keyframe, where the state is anchored, and its
/// covariance is the composition of those of the keyframes passed and of the last frame. Throws
/// std::runtime_error when the rows do not belong to the estimate.
[[nodiscard]] Consistency score_consistency(const Trajectory& truth, const Trajectory& estimate,
                                            const FramePairs& pairs, const std::vector<CovarianceRow>& rows,
                                            const TruthNoise& noise);

/// For people.
void print_consistency(std::ostream& stream, const Consistency& consistency);

/// For programs: one object.
[[nodiscard]] std::string consistency_json(const Consistency& consistency);

}  // namespace stereo_slam
