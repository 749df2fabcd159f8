// SPDX-License-Identifier: MIT
#pragma once

#include <optional>

#include "stereo_slam/dataset/sequence.hpp"

/// @file
/// Why the images of a recording do not agree with its calibration: mistakes that users make are undone one
/// by one, and the one is named with which the images agree.
namespace stereo_slam {

/// How thorough a search for the cause is.
enum class Suspicion {
  kSlight,  ///< the images agree almost: only causes with small effects are tried
  kStrong,
};

/// What is wrong with a recording.
struct Cause {
  Problem problem;
  /// Whether the problem is that right images are late by whole frames, which is not certain.
  bool may_be_part_of_a_frame = false;
};

/// The mistake that explains the images; nothing if none explains them clearly better than the
/// recording as it is. If two explain them equally well, the problem names both.
[[nodiscard]] std::optional<Cause> cause_of_disagreement(const StereoSequence& sequence, Suspicion suspicion);

/// The same for a recording that has no rectifier because the rig cannot be that of a stereo camera, such as
/// one with the right camera on the left. Nothing for other recordings.
[[nodiscard]] std::optional<Problem> cause_of_rejected_rig(const StereoSequence& sequence);

}  // namespace stereo_slam
