// SPDX-License-Identifier: MIT
#include "stereo_slam/loop_closing/map_segments.hpp"

#include <algorithm>
#include <stdexcept>

#include <fmt/format.h>

namespace stereo_slam {

void MapSegments::begin(std::size_t first_keyframe) {
  if (!first_keyframes_.empty() && first_keyframe <= first_keyframes_.back()) {
    throw std::invalid_argument(fmt::format("a segment begins with keyframe {}, the one before with {}",
                                            first_keyframe, first_keyframes_.back()));
  }
  roots_.push_back(roots_.size());
  first_keyframes_.push_back(first_keyframe);
}

void MapSegments::join(std::size_t a, std::size_t b) {
  const auto [kept, replaced] = std::minmax({root(a), root(b)});
  std::replace(roots_.begin(), roots_.end(), std::size_t{replaced}, std::size_t{kept});
}

}  // namespace stereo_slam
