// SPDX-License-Identifier: MIT
#include "stereo_slam/loop_closing/landmark_identity.hpp"

#include <algorithm>
#include <utility>

namespace stereo_slam {

void LandmarkIdentity::unite(std::uint32_t a, std::uint32_t b) {
  const std::uint32_t kept = std::min((*this)(a), (*this)(b));
  for (std::uint32_t id : {a, b}) {  // path compression: later look-ups take fewer steps
    while (id != kept) {
      const auto [place, is_new] = smaller_.try_emplace(id, kept);
      id = is_new ? kept : std::exchange(place->second, kept);
    }
  }
}

std::uint32_t LandmarkIdentity::operator()(std::uint32_t id) const {
  for (auto place = smaller_.find(id); place != smaller_.end(); place = smaller_.find(id)) {
    id = place->second;
  }
  return id;
}

}  // namespace stereo_slam
