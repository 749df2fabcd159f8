// SPDX-License-Identifier: MIT
#include "stereo_slam/slam/judgement.hpp"

namespace stereo_slam {

bool found_again(PoseBasis basis, bool after_loss) {
  return basis == PoseBasis::kKeyframe || (basis == PoseBasis::kLandmarks && after_loss);
}

TrackingStatus judge(const FrameEvidence& evidence) {
  const WeakReasons& weak = evidence.weak;
  if (!evidence.begins_map && evidence.basis == PoseBasis::kNothing)
    return evidence.waits ? TrackingStatus::kWeak : TrackingStatus::kLost;
  if (evidence.segment_localised) return TrackingStatus::kRelocalised;
  const bool place_unknown = weak.segment_not_localised && !evidence.segment_predicted;
  if (weak.right_image_unfit || weak.right_camera_turned || place_unknown) return TrackingStatus::kWeak;
  if (evidence.begins_map) return TrackingStatus::kInitializing;
  if (found_again(evidence.basis, evidence.after_loss)) return TrackingStatus::kRelocalised;
  const bool doubtful = weak.odometry_alone || weak.imu_alone || weak.imu_contradicted ||
                        weak.few_landmarks || weak.repetitive_scene;
  return doubtful ? TrackingStatus::kWeak : TrackingStatus::kOk;
}

}  // namespace stereo_slam
