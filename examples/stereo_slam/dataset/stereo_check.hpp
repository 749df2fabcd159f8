// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <vector>

#include "stereo_slam/dataset/sequence.hpp"
#include "stereo_slam/dataset/stereo_agreement.hpp"

namespace stereo_slam {

/// What a check of a recording found.
struct RecordingFindings {
  std::vector<Problem> problems;
  std::optional<DelayEstimate> right_delay{};  ///< of the right images, if they are likely late or early
};

/// The problems that the agreement shows, and a delay. `frames` are the frames of the sequence that were
/// compared; without them no cause is looked for. If the images do not agree, mistakes are tried that explain
/// it (see cause_of_disagreement); if none does, the problems say what is seen.
[[nodiscard]] RecordingFindings findings_of(const StereoAgreement& agreement, const StereoSequence& sequence,
                                            const std::vector<StereoFrame>& frames = {});

/// The problems among these findings.
[[nodiscard]] inline std::vector<Problem> problems_of(const StereoAgreement& agreement,
                                                      const StereoSequence& sequence,
                                                      const std::vector<StereoFrame>& frames = {}) {
  return findings_of(agreement, sequence, frames).problems;
}

}  // namespace stereo_slam
