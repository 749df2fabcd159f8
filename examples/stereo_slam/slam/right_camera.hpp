// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/frontend/online_rectification.hpp"
#include "stereo_slam/frontend/stereo_points.hpp"
#include "stereo_slam/frontend/stereo_view.hpp"
#include "stereo_slam/local_map/landmark.hpp"
#include "stereo_slam/local_map/match.hpp"
#include "stereo_slam/odometry/odometry.hpp"
#include "stereo_slam/settings/settings.hpp"
#include "stereo_slam/slam/right_image_monitor.hpp"

namespace stereo_slam {

/// What is known of the right camera besides its calibration: the rectification error, which is learned while
/// driving, and whether the right image of a frame fits the left one.
class RightCamera {
 public:
  RightCamera(const StereoCamera& camera, const OnlineRectificationSettings& settings)
      : camera_(camera), learns_(settings.enabled), rectification_(camera, settings) {}

  /// Goes on from what an earlier run learned.
  [[nodiscard]] static RightCamera resumed(const StereoCamera& camera,
                                           const OnlineRectificationSettings& settings,
                                           const RectificationEstimate& learned);

  // How to see a frame.

  [[nodiscard]] const StereoCamera& camera() const noexcept { return camera_; }
  [[nodiscard]] const RectificationEstimator& rectification() const noexcept { return rectification_; }
  [[nodiscard]] StereoView view_of(const StereoFrame& frame) const {
    return {frame, camera_, rectification_.current(), !is_ignored()};
  }
  /// Whether the right image of the frame is left out, as far as the frame was processed.
  [[nodiscard]] bool is_ignored() const { return judgement() == RightImage::kIgnored; }
  [[nodiscard]] bool fits() const { return monitor_.fits(); }
  [[nodiscard]] RightImage judgement() const { return monitor_.judgement(); }

  // What was seen.

  void begin_frame(bool has_right) { monitor_.begin_frame(has_right); }
  /// Points that were searched in both images.
  void saw(const RightImageFit& fit) { monitor_.add(fit); }
  /// Stereo matches of a frame, measured as view_of() says.
  void saw_rows(std::span<const StereoMeasurement> matches) {
    if (learns_) rectification_.add_rows(matches);
  }
  /// Learns the row offset anew from a pair in which hardly any stereo match is found, or none was searched
  /// yet. Returns whether the rows had been displaced.
  bool relearn_rows(const StereoFrame& frame);
  /// Ends a frame. In a long row of frames that were lost, or whose right image did not fit, the cameras may
  /// have been moved: from time to time the rows are learned anew. Returns whether they were displaced.
  bool end_frame(const StereoFrame& frame, bool unmeasured);

  // What changed.

  /// Refines the rectification by the landmarks of the last keyframe that were matched in this frame, seen
  /// from `T_keyframe_camera`. Returns how the frame's pose depends on the rectification. If the landmarks do
  /// not tell, points of the odometry do, which are given if it alone measured the motion. They are followed
  /// over one frame only, so they do not refine it.
  RectificationEffect refine(const std::vector<Match>& matches, const MapView& map,
                             const Pose& T_keyframe_camera, const OdometryResult& odometry);
  /// Whether the last motion showed that the right camera has turned.
  [[nodiscard]] bool noticed_turn() const noexcept { return rectification_.noticed_turn(); }
  /// Horizontal displacement of the right image that its rows do not show, at the principal point; zero as
  /// long as the calibration seems right, px.
  [[nodiscard]] double displacement_px() const {
    return rectification_.has_large_error() ? rectification_.current().coefficients()(0, 0) : 0.0;
  }
  [[nodiscard]] bool learns() const noexcept { return learns_; }

 private:
  static constexpr int kRelearnInterval = 10;  // frames

  StereoCamera camera_;
  bool learns_ = true;
  RectificationEstimator rectification_;
  RightImageMonitor monitor_;
  int frames_without_ = 0;  // in a row, that were lost or whose right image did not fit
};

}  // namespace stereo_slam
