// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "stereo_slam/dataset/sequence.hpp"
#include "stereo_slam/dataset/stereo_agreement.hpp"

namespace stereo_slam {

/// The problems that the agreement shows. `frames` are the frames of the sequence that were compared; without
/// them no cause is looked for. If the images do not agree, mistakes are tried that explain it (see
/// cause_of_disagreement); if none does, the problems say what is seen.
[[nodiscard]] std::vector<Problem> problems_of(const StereoAgreement& agreement,
                                               const StereoSequence& sequence,
                                               const std::vector<StereoFrame>& frames = {});

}  // namespace stereo_slam
