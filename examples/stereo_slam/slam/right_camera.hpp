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

  // Queries.

  [[nodiscard]] const StereoCamera& camera() const noexcept { return camera_; }
  [[nodiscard]] const RectificationEstimator& rectification() const noexcept { return rectification_; }
  [[nodiscard]] StereoView view_of(const StereoFrame& frame) const {
    return {frame, camera_, rectification_.current(), !is_ignored()};
  }
  /// Whether the right image of the frame is left out, judged by the points searched so far.
  [[nodiscard]] bool is_ignored() const { return judgement() == RightImage::kIgnored; }
  /// Whether the points of the frame fit, or nothing is known: see RightImageMonitor.
  [[nodiscard]] bool fits() const { return monitor_.fits(); }
  [[nodiscard]] RightImage judgement() const { return monitor_.judgement(); }

  // Measurements of a frame.

  void begin_frame(bool has_right) { monitor_.begin_frame(has_right); }
  /// Adds points that were searched in both images.
  void add_fit(const RightImageFit& fit) { monitor_.add(fit); }
  /// Adds stereo matches of a frame, measured as view_of() says: they observe the row offsets.
  void add_rows(std::span<const StereoMeasurement> matches) {
    if (learns_) rectification_.add_rows(matches);
  }
  /// Learns the row offsets anew from a pair in which hardly any stereo match is found, or none was searched
  /// yet. Returns whether the rows had been displaced.
  bool relearn_rows(const StereoFrame& frame);
  /// Ends a frame, which was lost or whose right image did not fit if `unmeasured`. The cameras may have been
  /// moved: in the second such frame in a row, and then in every tenth, the row offsets are learned anew.
  /// Returns whether the rows had been displaced.
  bool end_frame(const StereoFrame& frame, bool unmeasured);

  // Learning, at keyframes.

  /// Refines the rectification by the landmarks of the last keyframe that were matched in this frame, seen
  /// from `T_keyframe_camera`. Returns how the frame's pose depends on the rectification. If the landmarks do
  /// not tell this, the points of `odometry` do, which has some if it alone measured the motion; they are
  /// followed over one frame only, and refine nothing.
  RectificationEffect refine(const std::vector<Match>& matches, const MapView& map,
                             const Pose& T_keyframe_camera, const OdometryResult& odometry);
  /// Whether the last motion showed that the right camera has turned.
  [[nodiscard]] bool noticed_turn() const noexcept { return rectification_.noticed_turn(); }
  /// Horizontal displacement of the right image at the principal point, which row offsets cannot reveal; zero
  /// as long as the calibration seems right, px.
  [[nodiscard]] double displacement_px() const {
    return rectification_.has_large_error() ? rectification_.current().coefficients()(0, 0) : 0.0;
  }
  [[nodiscard]] bool learns() const noexcept { return learns_; }

 private:
  static constexpr int kFirstRelearn = 2;      // frames in a row
  static constexpr int kRelearnInterval = 10;  // frames

  StereoCamera camera_;
  bool learns_ = true;
  RectificationEstimator rectification_;
  RightImageMonitor monitor_;
  int unmeasured_frames_ = 0;  // in a row
};

}  // namespace stereo_slam
