// SPDX-License-Identifier: MIT
#include "stereo_slam/slam/tracker.hpp"

#include "stereo_slam/slam/paper_slam.hpp"
#include "stereo_slam/slam/slam.hpp"

namespace stereo_slam {

std::unique_ptr<Tracker> make_tracker(const StereoCamera& camera, const Settings& settings,
                                      LoopThread loop_thread, const SavedMap& loaded, MapUse use) {
  if (settings.tracker != TrackerKind::kPaper)
    return std::make_unique<Slam>(camera, settings, loop_thread, loaded, use);
  if (!loaded.keyframes.empty()) {
    throw std::invalid_argument(
        "the preset paper has no keyframes, by which a run is localised in a loaded map; use another preset");
  }
  return std::make_unique<PaperSlam>(camera, settings);
}

}  // namespace stereo_slam
