// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "stereo_slam/dataset/sequence.hpp"

/// Which images of two cameras were taken together: one rule for every kind of recording.
namespace stereo_slam {

/// Pairs of images of two cameras.
struct StampPairs {
  std::vector<std::pair<std::size_t, std::size_t>> pairs;  ///< indices of a left and a right image
  std::vector<std::size_t> left_alone;                     ///< images without a partner
  std::vector<std::size_t> right_alone;
  PairDistances distances;
  double most_apart_ms = 0.0;   ///< the bound that held
  std::int64_t nearest_ns = 0;  ///< the smallest distance of a left and a right image
};

/// Pairs the images that are nearest to each other and at most `most_apart_ns` apart; without it, less than
/// half the usual time between two images of the faster camera. Both lists increase.
[[nodiscard]] StampPairs pair_stamps(const std::vector<std::int64_t>& left_ns,
                                     const std::vector<std::int64_t>& right_ns,
                                     std::optional<std::int64_t> most_apart_ns);

/// The stamps of one camera, and what messages call it.
struct CameraStamps {
  std::string name;
  std::vector<std::int64_t> stamps_ns;
};

/// The pairs of pair_stamps(). Sets the distances of the sequence, and warns if they are above 1 ms. Throws
/// std::runtime_error that names the recording if there are less than two pairs.
[[nodiscard]] StampPairs paired_by_stamps(const CameraStamps& left, const CameraStamps& right,
                                          const PairingOptions& options, SequenceScan& scan);

/// Adds a warning if images have no partner.
void warn_of_lone_images(const CameraStamps& left, const CameraStamps& right, const StampPairs& pairs,
                         SequenceScan& scan);

}  // namespace stereo_slam
