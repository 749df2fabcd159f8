// SPDX-License-Identifier: MIT
#include "stereo_slam/loop_closing/map_ids.hpp"

namespace stereo_slam {

Keyframe MapIds::in_map(Keyframe keyframe) const {
  keyframe.frame += loaded_.frames;
  keyframe.segment += loaded_.segments;
  for (auto& point : keyframe.points) {
    if (point.landmark > 0) point.landmark += loaded_.landmarks;
  }
  return keyframe;
}

std::vector<KeyframeLink> MapIds::in_map(std::vector<KeyframeLink> links) const {
  for (auto& link : links) link.keyframe += loaded_.keyframes;
  return links;
}

}  // namespace stereo_slam
