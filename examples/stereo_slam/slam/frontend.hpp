// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/frontend/stereo_points.hpp"
#include "stereo_slam/frontend/stereo_view.hpp"
#include "stereo_slam/local_map/match.hpp"
#include "stereo_slam/odometry/odometry.hpp"
#include "stereo_slam/settings/settings.hpp"
#include "stereo_slam/slam/frame_images.hpp"
#include "stereo_slam/tracking/landmark_search.hpp"

namespace stereo_slam {

/// The front end of the SLAM: what it measures in the images of a frame. These are the motion since the
/// previous frame, the landmarks of the map, and points for new landmarks.
///
/// The motion and the landmarks are measured with different points of the image, so that their errors are
/// independent: one is the input of the filter, the other its measurement. The functions of the folder
/// `frontend/` do the work on the images.
class Frontend {
 public:
  Frontend() = default;
  Frontend(const Frontend&) = delete;
  Frontend& operator=(const Frontend&) = delete;
  virtual ~Frontend() = default;

  /// Extracts from a frame what the other functions need. May reuse the memory of `previous.before`.
  [[nodiscard]] virtual FrameImages prepare(const StereoFrame& frame, PreviousFrame& previous) const = 0;

  /// The motion since the previous frame: the system input u_k (eq. 11).
  [[nodiscard]] virtual OdometryResult measure_motion(const ConsecutivePyramids& pyramids,
                                                      const StereoView& view,
                                                      const ExpectedMotion& expected) = 0;

  /// The landmarks of the map in this frame (Alg. 3, sec. IV-C), expected where they are in view of a camera
  /// at `T_keyframe_camera`.
  [[nodiscard]] virtual Association find_landmarks(const LandmarkSearch& search,
                                                   const PoseGaussian& T_keyframe_camera,
                                                   const FrameImages& images, const StereoView& view,
                                                   const OdometryResult& odometry) const = 0;

  /// Notes which points are static, for the next call of measure_motion. `matches` are the landmarks found in
  /// this frame, and `T_previous_current` is the motion relative to them. Depending on the front end, the
  /// static points are those that agree with this motion, or the landmarks. Without a motion there are none.
  virtual void note_static_points(const std::optional<Pose>& T_previous_current,
                                  const std::vector<Match>& matches) = 0;

  /// Chooses the points of this frame that the next call of measure_motion starts from, away from
  /// `landmarks_px`.
  virtual void choose_odometry_points(const FrameImages& images, const StereoView& view,
                                      const std::vector<Vector2<double>>& landmarks_px) = 0;

  /// Points with a disparity, for landmarks and keyframes. The feature front end leaves out those near
  /// `reserved_px`; the patch front end is always called without any.
  [[nodiscard]] virtual StereoPoints measure_points(
      const FrameImages& images, const StereoView& view,
      const std::vector<Vector2<double>>& reserved_px) const = 0;

  /// Whether the points of measure_points() have descriptors.
  [[nodiscard]] virtual bool describes_points() const = 0;

  /// Number of points to report for this frame; see FrameResult::features.
  [[nodiscard]] virtual std::size_t count_features(const FrameImages& images) const = 0;

  /// Converts what is kept from measurements with the rectification `before` to `after`.
  virtual void change_rectification(const RectificationResidual& before,
                                    const RectificationResidual& after) = 0;

  /// Forgets all points.
  virtual void restart() = 0;
};

/// The default. Points are followed over many frames for the motion, and patches of the keyframe are aligned
/// at its landmarks.
[[nodiscard]] std::unique_ptr<Frontend> make_patch_frontend(const StereoCamera& camera,
                                                            const Settings& settings);

/// The paper's: circular matching for the motion (sec. IV-B), and features matched by their descriptors for
/// the landmarks (sec. IV-C).
[[nodiscard]] std::unique_ptr<Frontend> make_feature_frontend(const Settings& settings);

}  // namespace stereo_slam
