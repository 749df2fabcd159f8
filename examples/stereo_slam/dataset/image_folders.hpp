// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <filesystem>
#include <vector>

#include "stereo_slam/dataset/sequence.hpp"
#include "stereo_slam/stamps/name_times.hpp"

/// The images in the folders of a camera of one's own: which are pairs, and which are missing.
namespace stereo_slam {

/// The images of a folder in order, and what their names say about time.
struct ImageList {
  std::vector<std::filesystem::path> files;
  NameTimes times;  ///< of the files; their keys do not decrease
};

/// The images in a folder, in the order of the times in their names, or else in natural order, img9 before
/// img10; without hidden ones. Throws std::runtime_error if there are none, if one is a link to nothing, if
/// most are named by a number and another is not, or if times_in() finds no order.
[[nodiscard]] ImageList list_images(const std::filesystem::path& folder);

/// Fills the frames with the pairs of images that have the nearest stamps, if both cameras' names are stamps;
/// else with those that have the same name, or with pairs by number or order if no names are the same. Sets
/// the stamps of the frames if the left images have stamps. Adds a warning if images have no partner; throws
/// std::runtime_error if there are no pairs.
void pair_images(const ImageList& left, const ImageList& right, const PairingOptions& options,
                 SequenceScan& scan);

}  // namespace stereo_slam
