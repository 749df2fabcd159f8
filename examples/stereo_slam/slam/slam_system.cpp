// SPDX-License-Identifier: MIT
#include "stereo_slam/slam/slam_system.hpp"

#include "stereo_slam/slam/paper_slam.hpp"
#include "stereo_slam/slam/slam.hpp"

namespace stereo_slam {

std::unique_ptr<SlamSystem> make_slam_system(const StereoCamera& camera, const Settings& settings,
                                             LoopThread loop_thread, const SavedMap& loaded, MapUse use) {
  if (settings.system != SystemKind::kPaper)
    return std::make_unique<Slam>(camera, settings, loop_thread, loaded, use);
  if (!loaded.keyframes.empty()) {
    throw std::invalid_argument(
        "the preset paper has no keyframes, by which a run is localised in a loaded map; use another preset");
  }
  return std::make_unique<PaperSlam>(camera, settings);
}

}  // namespace stereo_slam
