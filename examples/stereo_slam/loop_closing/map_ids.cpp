// SPDX-License-Identifier: MIT
#include "stereo_slam/loop_closing/map_ids.hpp"

namespace stereo_slam {

Keyframe MapIds::in_map(Keyframe keyframe) const {
  keyframe.frame += loaded_.frames;
  keyframe.segment += loaded_.segments;
  for (auto& point : keyframe.points) point.landmark = landmark_in_map(point.landmark);
  return keyframe;
}

std::vector<KeyframeLink> MapIds::in_map(std::vector<KeyframeLink> links) const {
  for (auto& link : links) link.keyframe = keyframe_in_map(link.keyframe);
  return links;
}

}  // namespace stereo_slam
