// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstdint>
#include <unordered_map>
#include <utility>

namespace stereo_slam {

/// Ids that belong to the same landmark. A landmark that is re-observed after its track was lost gets a
/// second id; a loop unites the two.
class LandmarkIdentity {
 public:
  /// Declares that two ids belong to one landmark.
  void unite(std::uint32_t a, std::uint32_t b) {
    const std::uint32_t kept = std::min((*this)(a), (*this)(b));
    for (std::uint32_t id : {a, b}) {  // path compression: later look-ups take fewer steps
      while (id != kept) {
        const auto [place, is_new] = smaller_.try_emplace(id, kept);
        id = is_new ? kept : std::exchange(place->second, kept);
      }
    }
  }

  /// The smallest id of the same landmark.
  [[nodiscard]] std::uint32_t operator()(std::uint32_t id) const {
    for (auto place = smaller_.find(id); place != smaller_.end(); place = smaller_.find(id)) {
      id = place->second;
    }
    return id;
  }

 private:
  std::unordered_map<std::uint32_t, std::uint32_t> smaller_;  // for an id, a smaller one of the same landmark
};

}  // namespace stereo_slam
