// SPDX-License-Identifier: MIT
#include "landmark_identity.hpp"

#include <algorithm>
#include <utility>

namespace stereo_slam {

void LandmarkIdentity::unite(std::uint32_t a, std::uint32_t b) {
  const auto [kept, replaced] = std::minmax({(*this)(a), (*this)(b)});
  while (smaller_.size() <= replaced) smaller_.push_back(static_cast<std::uint32_t>(smaller_.size()));
  smaller_[replaced] = kept;
  for (std::uint32_t number : {a, b}) {  // later look-ups take a shorter way
    while (number < smaller_.size() && number != kept) number = std::exchange(smaller_[number], kept);
  }
}

std::uint32_t LandmarkIdentity::operator()(std::uint32_t number) const {
  while (number < smaller_.size() && smaller_[number] != number) number = smaller_[number];
  return number;
}

}  // namespace stereo_slam
