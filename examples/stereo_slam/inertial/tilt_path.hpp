// SPDX-License-Identifier: MIT
#pragma once

#include <optional>

#include "stereo_slam/core/tilt_measurement.hpp"
#include "stereo_slam/core/types.hpp"

namespace stereo_slam {

/// The path over the keyframes, without loops. While the inertial filter runs, its keyframes have the tilt
/// that the filter knows. All in the axes of the camera.
class TiltPath {
 public:
  /// The covariance of the rotation of the last keyframe relative to the first one.
  [[nodiscard]] Matrix3<double> rotation_covariance() const {
    return T_first_keyframe_.estimate.covariance.topLeftCorner<3, 3>();
  }

  /// The filter begins to run, with this vertical in the axes of the last keyframe, and with the rotation of
  /// the keyframe that the path has.
  void begin(const Vector3<double>& vertical_keyframe) {
    vertical_first_ = T_first_keyframe_.estimate.pose.rotation_matrix() * vertical_keyframe.normalized();
  }

  /// Goes on to the next keyframe, which the filter, if it runs, has turned by `turn` from where the path
  /// leads to with this link.
  [[nodiscard]] LevelledLink add(const PoseGaussian& T_previous_keyframe,
                                 const std::optional<KnownTurn>& turn) {
    LevelledLink link{.T_previous_keyframe = T_previous_keyframe};
    if (turn) link = level(T_first_keyframe_, T_previous_keyframe, vertical_first_, *turn);
    T_first_keyframe_ = compose(T_first_keyframe_, link.T_previous_keyframe);
    if (link.tilt) T_first_keyframe_ = with_tilt(T_first_keyframe_, *link.tilt);
    return link;
  }

 private:
  LinkedPose T_first_keyframe_;  // without the common error
  Vector3<double> vertical_first_ = Vector3<double>::UnitY();
};

}  // namespace stereo_slam
