// SPDX-License-Identifier: MIT
#include "stereo_slam/loop_closing/landmark_identity.hpp"

#include <algorithm>
#include <utility>

namespace stereo_slam {

void LandmarkIdentity::unite(std::uint32_t a, std::uint32_t b) {
  const std::uint32_t kept = std::min((*this)(a), (*this)(b));
  for (std::uint32_t number : {a, b}) {  // all on the way: later look-ups take a shorter one
    while (number != kept) {
      const auto [place, is_new] = smaller_.try_emplace(number, kept);
      number = is_new ? kept : std::exchange(place->second, kept);
    }
  }
}

std::uint32_t LandmarkIdentity::operator()(std::uint32_t number) const {
  for (auto place = smaller_.find(number); place != smaller_.end(); place = smaller_.find(number)) {
    number = place->second;
  }
  return number;
}

}  // namespace stereo_slam
