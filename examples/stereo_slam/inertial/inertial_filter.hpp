// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "stereo_slam/core/imu_readings.hpp"
#include "stereo_slam/core/inertial_estimate.hpp"
#include "stereo_slam/core/tilt_measurement.hpp"
#include "stereo_slam/core/types.hpp"
#include "stereo_slam/inertial/image_drift.hpp"
#include "stereo_slam/inertial/inertial_state.hpp"
#include "stereo_slam/inertial/innovation_monitor.hpp"
#include "stereo_slam/inertial/motion_fusion.hpp"
#include "stereo_slam/inertial/noise_in_motion.hpp"
#include "stereo_slam/inertial/reading_faults.hpp"
#include "stereo_slam/inertial/tilt_path.hpp"

namespace stereo_slam {

/// The pose of a frame before its landmarks are measured: by the IMU, and by the motion that the odometry
/// measured, if that agrees.
struct InertialPrior {
  InertialStep step;
  PoseGaussian T_keyframe_camera;
  /// How its error depends on that of the pose before, as InertialStep::pose_regression().
  Matrix6<double> camera_regression = Matrix6<double>::Zero();
  std::optional<double> nis{};  ///< of the odometry's motion, of 6 degrees of freedom, if there is one
  bool contradicts = false;     ///< the odometry's motion is that of something else, and was not used
};

/// What the images showed of a frame.
struct SeenFrame {
  std::int64_t stamp_ns = 0;
  PoseGaussian T_keyframe_camera;                    ///< the posterior, or the prior if nothing was seen
  std::optional<PoseGaussian> T_previous_current{};  ///< if it was measured, with the noise of the odometry
  bool by_landmarks = false;                         ///< the landmarks of the keyframe agree with the pose
  bool relocalised = false;                          ///< the pose does not follow from the one before
  bool refutes_imu = false;  ///< the odometry contradicts the prediction, and the landmarks agree with it
};

/// Velocity, gravity and biases by an IMU, jointly with the pose relative to the reference keyframe.
///
/// It starts in motion or at rest: with everything unknown it is a recursive least-squares estimate, by the
/// readings and the motions that the images show, until its covariance says that velocity and tilt are known
/// and gravity has its length. From then on it predicts the pose. Images that contradict it persistently make
/// it start anew, and after some times it is off for good.
///
/// While it runs, its state contains the posterior of the pose: an update of the pose corrects the rest by
/// regression.
class InertialFilter {
 public:
  /// Takes the readings that come with a frame, and predicts the frame.
  void begin_frame(std::int64_t stamp_ns, const std::optional<ImuReadings>& imu);

  /// The step to the frame, by the IMU alone; nothing unless the filter runs and there are readings.
  [[nodiscard]] const std::optional<InertialStep>& predicted() const noexcept { return predicted_; }

  /// The motion T_previous_current of the camera that is predicted. Only if there is a prediction.
  [[nodiscard]] Pose predicted_motion() const;

  /// The prior of the frame, with the odometry's motion, if it is valid. Only if there is a prediction.
  [[nodiscard]] InertialPrior prior(const std::optional<PoseGaussian>& T_previous_current) const;

  /// What the drift of the images since the keyframe adds to the covariance of the pose T_keyframe_camera
  /// that they show. Nothing unless the filter runs.
  [[nodiscard]] std::optional<Matrix6<double>> drift_covariance() const;

  /// Begins at a frame whose camera is the reference keyframe.
  void begin_map(std::int64_t stamp_ns);

  /// Takes what the images showed of the frame; `prior` is that of this frame, if there was one.
  void end_frame(const SeenFrame& seen, const std::optional<InertialPrior>& prior);

  /// Takes over that the motion of the camera since the keyframe is another one, changed on the right by
  /// `change`, rad and m, by what the last frame taught of the cameras: so were the motions before, by which
  /// the velocity is known. Call it before change_keyframe().
  void remeasure(const Vector6<double>& change);

  /// Makes the last frame the reference keyframe. Takes the link to it by the images and returns the one for
  /// the path, which has the tilt that gravity tells.
  [[nodiscard]] LevelledLink change_keyframe(const PoseGaussian& T_previous_keyframe);

  /// Velocity, gravity and biases of the last frame that was measured in, or predicted now.
  [[nodiscard]] InertialEstimate estimate() const;

  /// Whether it was given up at the last frame: it contradicts the images.
  [[nodiscard]] bool given_up() const noexcept { return given_up_; }

  [[nodiscard]] const InertialSummary& summary() const noexcept { return summary_; }

 private:
  [[nodiscard]] bool running() const noexcept { return summary_.phase == InertialPhase::kRunning; }
  [[nodiscard]] ReadMotion motion_of(const InertialState& state, const antipode::TimeInterval& images) const;
  [[nodiscard]] PoseGaussian in_imu(const PoseGaussian& camera) const;
  [[nodiscard]] PoseGaussian in_camera(const PoseGaussian& imu) const;
  void begin(std::int64_t stamp_ns, const InertialState& itself);
  void continue_start(const SeenFrame& seen);
  void relinearise_start();
  void try_to_run(const SeenFrame& seen);
  void continue_run(const SeenFrame& seen, const std::optional<InertialPrior>& prior);
  void cross_gap(const SeenFrame& seen);
  void give_up(const SeenFrame& seen);
  bool correct_delay(const SeenFrame& seen, std::int64_t accounted_ns);
  [[nodiscard]] InertialState unknown() const;
  void summarise();
  void remember(const SeenFrame& seen);
  void forget_samples();

  /// The motion of the IMU since the frame before, as the images showed it.
  struct StartMotion {
    std::int64_t stamp_ns = 0;
    PoseGaussian T_previous_current;
  };

  InertialSummary summary_;
  ImuSensor sensor_;
  std::vector<ImuSample> samples_;  // since shortly before the rotations
  std::int64_t moved_ns_ = 0;       // by how much their stamps were made earlier
  NoiseInMotion noise_;
  ImageDrift drift_;
  TiltPath tilt_path_;
  std::vector<SeenRotation> rotations_;  // of the last frames, to find the cause of a contradiction
  std::optional<InertialStep> predicted_;
  InertialState state_ = unknown_state();  // relative to the keyframe while it runs, else to itself
  std::int64_t stamp_ns_ = 0;              // of the state
  std::int64_t keyframe_ns_ = 0;           // of the reference keyframe
  bool begun_ = false;
  bool given_up_ = false;
  int motions_ = 0;  // measured since the start began
  std::int64_t start_ns_ = 0;
  std::vector<StartMotion> started_;  // the motions since then
  double started_at_s_ = 0.0;         // the delay about which they were linearised
  int frames_ = 0;                    // that were measured
  int corrections_ = 0;               // of the stamps
  InnovationMonitor innovations_;
};

}  // namespace stereo_slam
