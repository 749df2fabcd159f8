// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <ostream>
#include <string_view>

#include "stereo_slam/dataset/sequence.hpp"
#include "stereo_slam/dataset/stereo_check.hpp"
#include "stereo_slam/results/pose_frame.hpp"

namespace stereo_slam {

/// Result of a thorough check of a recording: of every image file, and on a few frames of the rectification
/// and the order of the cameras.
struct Inspection {
  SequenceScan scan;
  StereoAgreement agreement;
  std::size_t images_read = 0;  ///< of a video, bag or camera, of which only a few are checked; else 0
};

[[nodiscard]] Inspection inspect(SequenceScan scan);

/// First line of a ground-truth file written by `info`.
constexpr std::string_view kGroundTruthHeader =
    "# ground truth of stereo_slam info: stamp tx ty tz qx qy qz qw";

/// Writes the recording's ground truth as a TUM trajectory, for `evaluate` with a run of the same
/// --pose-frame. Throws std::runtime_error when there is none.
void write_ground_truth(std::ostream& stream, const StereoSequence& sequence, PoseFrame frame);

/// Prints the contents of the recording and its problems.
void print_inspection(std::ostream& stream, const Inspection& inspection);

}  // namespace stereo_slam
