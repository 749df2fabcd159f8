// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string_view>

#include "stereo_slam/dataset/sequence.hpp"

namespace stereo_slam {

inline constexpr std::string_view kEurocLayout =
    "mav0/cam0 and mav0/cam1 with data.csv, sensor.yaml and data/*.png each";

/// Whether the folder contains an EuRoC recording, or is its mav0.
[[nodiscard]] bool looks_like_euroc(const std::filesystem::path& folder);

/// Scans a recording in the ASL layout of EuRoC and TUM-VI, from mav0 or the folder that contains it:
///  - cam0 and cam1 (left, right), each with data.csv (stamp in ns, file name, and columns that are not
///    used) and data/;
///  - the calibration: sensor.yaml of each camera, or Kalibr's camchain.yaml in mav0, beside it, or in dso/
///    beside it;
///  - the ground truth T_world_body, if there is one: state_groundtruth_estimate0 or mocap0.
/// Rows of the two data.csv are paired by stamp, see pair_stamps(). Rows without a partner are left out; a
/// warning counts them.
[[nodiscard]] SequenceScan scan_euroc(const std::filesystem::path& folder,
                                      const PairingOptions& pairing = {});

}  // namespace stereo_slam
