// SPDX-License-Identifier: MIT
#include "stereo_slam/app/live_view.hpp"

#include <chrono>

namespace stereo_slam {

void LiveView::show(const StereoFrame& frame, const FrameResult& result, SlamSystem& slam) {
  using Clock = std::chrono::steady_clock;
  marks_.push_back({result.status, result.is_keyframe});
  const auto loops = slam.loop_events_if_idle();
  if (loops && loops->size() > loops_.size()) loops_.assign(loops->begin(), loops->end());
  const auto begin = Clock::now();
  if (!duty_cycle_.is_due(begin)) return;
  const auto tracks = slam.landmark_tracks();
  const auto path = slam.trajectory();
  viewer_.show(draw_view({.camera = camera_,
                          .frame = frame,
                          .result = result,
                          .tracks = tracks,
                          .path = path,
                          .marks = marks_,
                          .map = slam.archived_map_points(),
                          .loops = loops_}));
  duty_cycle_.worked(begin, Clock::now());
}

}  // namespace stereo_slam
