// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Geometry>

#include "camera/stereo_camera.hpp"
#include "types.hpp"

/// A recording as plain data: which files make up which frame, and how the camera sees. A new dataset format
/// is one function that fills a SequenceScan, and one line in scan_sequence.
namespace stereo_slam {

/// Files of one stereo frame.
struct StereoFiles {
  std::int64_t stamp_ns = 0;
  std::filesystem::path left;
  std::filesystem::path right;
};

/// Rectified stereo recording.
struct StereoSequence {
  std::filesystem::path folder;
  std::string format;                           ///< "kitti"
  StereoCamera camera;                          ///< of every frame, image size included
  std::vector<StereoFiles> frames;              ///< stamps increase
  std::vector<Eigen::Isometry3d> ground_truth;  ///< T_world_camera of every frame, or empty
};

/// Something wrong with a recording: what, where, what to do. Errors make it unusable as a whole.
struct Problem {
  enum class Severity { kWarning, kError };
  Severity severity = Severity::kError;
  std::string text;
};

[[nodiscard]] inline bool is_error(const Problem& problem) {
  return problem.severity == Problem::Severity::kError;
}

/// What could be made of a folder, with every problem found on the way.
struct SequenceScan {
  StereoSequence sequence;
  std::vector<Problem> problems;
};

/// Looks at everything but the images (of which it opens the first). `format`: kitti, euroc or auto.
[[nodiscard]] SequenceScan scan_sequence(const std::filesystem::path& folder, std::string_view format);

/// The sequence of scan_sequence, or std::runtime_error with the first of its errors.
[[nodiscard]] StereoSequence open_sequence(const std::filesystem::path& folder, std::string_view format);

/// That an image has another size than the sequence's camera.
[[nodiscard]] Problem wrong_size(const std::filesystem::path& file, int width_px, int height_px,
                                 const StereoCamera& camera);

/// Reads a frame. Throws std::runtime_error naming the file when an image is missing, damaged or of another
/// size.
[[nodiscard]] StereoFrame load_frame(const StereoSequence& sequence, std::size_t index);

}  // namespace stereo_slam
