// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string_view>

#include "stereo_slam/calibration/calibration_file.hpp"
#include "stereo_slam/dataset/sequence.hpp"

namespace stereo_slam {

inline constexpr std::string_view kCalibrationFile = "calibration.yaml";
inline constexpr std::string_view kOwnCameraLayout =
    "calibration.yaml with the folders left and right, or two videos; see docs/datasets.md";

/// Whether this is a file with the extension of a calibration: yaml, yml, xml, json or conf.
[[nodiscard]] bool is_calibration_file(const std::filesystem::path& file);

/// The calibration in a folder: calibration.yaml, .yml, .xml or .json, camchain.yaml or
/// kalibr_imucam_chain.yaml, left.yaml or ost.txt of ROS, or SN....conf of a ZED; empty if there is none.
/// Throws std::runtime_error if a folder has one of these names, or if there are several of a ZED.
[[nodiscard]] std::filesystem::path find_calibration(const std::filesystem::path& folder);

/// Sets the camera of a sequence, and its rectification. The image size is that of the first image. Throws
/// std::runtime_error that names the calibration when it does not fit the image size.
void set_camera(const OwnCamera& own, const std::filesystem::path& calibration, StereoSequence& sequence);

struct OwnCameraFiles {
  std::filesystem::path calibration;  ///< see read_calibration
  /// The folder that contains the image folders or videos named in the calibration (empty: the folder of the
  /// calibration); or a video or live camera with both images side by side; or two of these: LEFT,RIGHT.
  std::filesystem::path dataset;
};

/// Scans a recording of a user's own camera: a calibration (see docs/datasets.md), and folders of images,
/// videos or live cameras. `format` is folders, video, or auto to use whichever is there.
///
/// pair_images() pairs the images. Stamps come from the file of times, from the names of the left images, or
/// from the frame rate.
[[nodiscard]] SequenceScan scan_own_camera(const OwnCameraFiles& files, std::string_view format,
                                           const PairingOptions& pairing = {});

}  // namespace stereo_slam
