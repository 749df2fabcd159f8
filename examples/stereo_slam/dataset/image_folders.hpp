// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "stereo_slam/dataset/sequence.hpp"

/// The images in the folders of a camera of one's own: which are pairs, and which are missing.
namespace stereo_slam {

/// The stamp that is the name of an image: a number of 13 digits or more in nanoseconds, or a decimal number
/// of seconds since 1970, 1700000000.25. Nothing for other names.
[[nodiscard]] std::optional<std::int64_t> stamp_in_name(const std::filesystem::path& image);

/// The images in a folder, in natural order: img9 before img10, and 1700000000.25 before 1700000000.5,
/// without hidden ones. Throws std::runtime_error if there are none, if one is a link to nothing, or if most
/// are named by a number and another is not.
[[nodiscard]] std::vector<std::filesystem::path> list_images(const std::filesystem::path& folder);

/// Fills the frames with the pairs of images that have the same name, or with pairs by order if no names are
/// the same. Adds a warning if images have no partner; throws std::runtime_error if the order pairs nothing.
void pair_images(const std::vector<std::filesystem::path>& left,
                 const std::vector<std::filesystem::path>& right, SequenceScan& scan);

/// Where the frames were in the recording before images were lost.
struct FramePositions {
  std::vector<std::size_t> of_frame;
  std::size_t count = 0;    ///< of all frames, also the lost ones
  std::size_t missing = 0;  ///< frames of which neither image is there

  /// Positions of so many frames, of which none was lost.
  [[nodiscard]] static FramePositions without_gaps(std::size_t count);
};

/// Positions by the numbers in the names, or in the order of the names if these are no numbers. `images` are
/// those of both cameras, of which `frames` are pairs.
[[nodiscard]] FramePositions positions_of(const std::vector<StereoFiles>& frames,
                                          const std::vector<std::filesystem::path>& images);

}  // namespace stereo_slam
