// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "stereo_slam/core/pose_estimate.hpp"
#include "stereo_slam/inertial/inertial_filter.hpp"
#include "stereo_slam/local_map/match.hpp"
#include "stereo_slam/odometry/odometry.hpp"
#include "stereo_slam/tracking/update.hpp"

namespace stereo_slam {

/// What the pose of a frame was measured against.
enum class PoseBasis {
  kNothing,    ///< predicted
  kImu,        ///< predicted by the readings of an IMU
  kOdometry,   ///< the previous frame alone
  kLandmarks,  ///< the landmarks of the reference keyframe too
  kKeyframe,   ///< the reference keyframe, recognised after a loss
};

/// One step of the filter: the pose of a frame relative to the reference keyframe, and what it came from.
struct TrackedPose {
  PoseGaussian prior;      ///< T_keyframe_camera, predicted
  PoseGaussian posterior;  ///< T_keyframe_camera
  PoseBasis basis = PoseBasis::kNothing;
  OdometryResult odometry;
  std::vector<Match> matches;  ///< landmarks found in this frame
  double nis = 0.0;            ///< normalised innovation squared of the update
  int nis_dof = 0;
  Vector2<double> variance_ratio = Vector2<double>::Ones();  ///< see PoseUpdate
  std::optional<InertialPrior> inertial{};                   ///< what the prior rests on, if an IMU is used
  bool refutes_imu = false;                                  ///< see FrameMeasurement

  /// The prior, corrected by an update with `matches`.
  [[nodiscard]] static TrackedPose updated(const PoseGaussian& prior, OdometryResult odometry,
                                           std::vector<Match> matches, const PoseUpdate& update);

  /// Whether the images of the frame measured it.
  [[nodiscard]] bool measured() const noexcept {
    return basis != PoseBasis::kNothing && basis != PoseBasis::kImu;
  }

  /// Whether landmarks measured the pose, but so few that they may agree by chance, as in images blurred by
  /// motion.
  [[nodiscard]] bool has_few_landmarks() const noexcept;

  /// Writes motion, matches and innovation into the result.
  void report(FrameResult& result) const;

  /// Notes what an IMU had to do with the prior, if one is used.
  void use_imu(std::optional<InertialPrior> imu) {
    inertial = std::move(imu);
    if (inertial && basis == PoseBasis::kNothing) basis = PoseBasis::kImu;
  }

  /// Takes the pose relative to the reference keyframe as the posterior, if the keyframe was recognised.
  void use_keyframe(const std::optional<PoseGaussian>& recognised) {
    if (!recognised) return;
    posterior = *recognised;
    basis = PoseBasis::kKeyframe;
  }
};

}  // namespace stereo_slam
