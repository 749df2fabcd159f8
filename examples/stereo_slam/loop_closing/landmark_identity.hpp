// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <unordered_map>

namespace stereo_slam {

/// Ids that belong to the same landmark. A landmark that is re-observed after its track was lost gets a
/// second id; a loop unites the two.
class LandmarkIdentity {
 public:
  /// Declares that two ids belong to one landmark.
  void unite(std::uint32_t a, std::uint32_t b);

  /// The smallest id of the same landmark.
  [[nodiscard]] std::uint32_t operator()(std::uint32_t id) const;

 private:
  std::unordered_map<std::uint32_t, std::uint32_t> smaller_;  // for an id, a smaller one of the same landmark
};

}  // namespace stereo_slam
