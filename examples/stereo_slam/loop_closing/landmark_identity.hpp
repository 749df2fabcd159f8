// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <unordered_map>

namespace stereo_slam {

/// Which numbers of landmarks stand for the same point: a point that a loop shows again had got a second one.
class LandmarkIdentity {
 public:
  /// Says that two numbers stand for one landmark.
  void unite(std::uint32_t a, std::uint32_t b);

  /// The smallest number that stands for the same landmark.
  [[nodiscard]] std::uint32_t operator()(std::uint32_t number) const;

 private:
  std::unordered_map<std::uint32_t, std::uint32_t> smaller_;  // another number of the same landmark
};

}  // namespace stereo_slam
