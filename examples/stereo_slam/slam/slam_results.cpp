// SPDX-License-Identifier: MIT
// The part of the SLAM that reports trajectory, covariances, map and loops.
#include <algorithm>
#include <cmath>

#include "stereo_slam/local_map/landmark_tracks.hpp"
#include "stereo_slam/slam/slam.hpp"

namespace stereo_slam {

/// Calibration errors that no image shows are assumed to be proportional to the row offset, which images
/// show.
CalibrationError Slam::calibration_error() const {
  const auto& allowed = settings_.calibration;
  const RectificationEstimator& rectification = right_camera_.rectification();
  const double seen_px = rectification.current().rms_offset_px().y();
  const double scale =
      std::hypot(allowed.scale_sigma, allowed.scale_sigma_per_px * seen_px, rectification.scale_sigma());
  const double axes_px =
      std::hypot(allowed.principal_point_sigma_px, allowed.principal_point_per_px * seen_px);
  const double fx = right_camera_.camera().fx;
  return {.scale_sigma = std::min(scale, kLargestCalibrationError),
          .axes_sigma_rad = std::min(axes_px / fx, kLargestCalibrationError),
          .common_error_rad = std::min(allowed.common_error_px / fx, kLargestCalibrationError)};
}

std::vector<PoseGaussian> Slam::trajectory() const { return path_.poses(calibration_error()); }

std::vector<LandmarkTrack> Slam::landmark_tracks() const {
  if (path_.frames() == 0) return {};
  return tracks_in_view(local_map_.view(), posterior_.pose(), path_.frames() - 1);
}

SavedMap Slam::saved_map() const {
  SavedMap map;
  map.camera = right_camera_.camera();
  map.rectification = right_camera_.rectification().estimate();
  path_.save(local_map_, map);
  return map;
}

}  // namespace stereo_slam
