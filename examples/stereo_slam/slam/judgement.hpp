// SPDX-License-Identifier: MIT
#pragma once

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/slam/tracked_pose.hpp"

namespace stereo_slam {

/// What is known of a frame once it was measured and the map extended.
struct FrameEvidence {
  PoseBasis basis = PoseBasis::kNothing;
  bool begins_map = false;  ///< the first frame with a map
  bool waits = false;       ///< predicted, but only since the last frame: a repeated image
  bool after_loss = false;  ///< the previous frame that was measured in was lost
  bool segment_predicted =
      false;  ///< the place of the map segment was predicted over a short gap, some time ago
  bool segment_localised = false;  ///< the place of the map segment became known just before this frame
  bool turn_measured = false;  ///< a turn of the right camera was measured in every frame since it happened
  WeakReasons weak{};
};

/// Whether the pose is measured in a map that was lost before.
[[nodiscard]] inline bool found_again(PoseBasis basis, bool after_loss) {
  return basis == PoseBasis::kKeyframe || (basis == PoseBasis::kLandmarks && after_loss);
}

/// The status of a frame. A frame that is measured in the map again after a loss is kRelocalised, even if few
/// landmarks tell or the scene is repetitive; its reasons say so.
[[nodiscard]] inline TrackingStatus judge(const FrameEvidence& evidence) {
  const WeakReasons& weak = evidence.weak;
  if (!evidence.begins_map && evidence.basis == PoseBasis::kNothing)
    return evidence.waits ? TrackingStatus::kWeak : TrackingStatus::kLost;
  if (evidence.segment_localised) return TrackingStatus::kRelocalised;
  const bool place_unknown = weak.segment_not_localised && !evidence.segment_predicted;
  const bool turn_unknown = weak.right_camera_turned && !evidence.turn_measured;
  if (weak.right_image_unfit || turn_unknown || place_unknown) return TrackingStatus::kWeak;
  if (evidence.begins_map) return TrackingStatus::kInitializing;
  if (found_again(evidence.basis, evidence.after_loss)) return TrackingStatus::kRelocalised;
  const bool doubtful = weak.odometry_alone || weak.imu_alone || weak.imu_contradicted ||
                        weak.few_landmarks || weak.sudden_motion || weak.repetitive_scene;
  return doubtful ? TrackingStatus::kWeak : TrackingStatus::kOk;
}

}  // namespace stereo_slam
