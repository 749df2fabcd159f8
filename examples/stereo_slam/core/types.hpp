// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <opencv2/core.hpp>

#include <antipode/distributions/pose_gaussian.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/geometry/dual_quaternion.hpp>

#include "stereo_slam/core/imu_readings.hpp"
#include "stereo_slam/core/inertial_estimate.hpp"

/// @file
/// Data that the stages of the SLAM hand to each other. Pixels, metres, radians; `T_a_b` maps b to a.
/// Equations, algorithms and sections cited in this program ("eq. 11", "Alg. 2", "sec. IV-C", "the paper")
/// are those of DQV-SLAM: S. Bultmann, K. Li, U. D. Hanebeck, "Stereo Visual SLAM Based on Unscented Dual
/// Quaternion Filtering", FUSION 2019.
namespace stereo_slam {

using antipode::Matrix2;
using antipode::Matrix3;
using antipode::Matrix6;
using antipode::Vector2;
using antipode::Vector3;
using antipode::Vector6;
using Matrix6x3 = antipode::Matrix<double, 6, 3>;  ///< covariances of a pose and a point

using Pose = antipode::DualQuaternion<double>;  ///< `T_a_b` maps coordinates of b to those of a

/// The pose of an isometry, as files and calibrations have them: with the rotation that is nearest to a
/// matrix of few digits.
[[nodiscard]] inline Pose to_pose(const Eigen::Isometry3d& T) {
  return Pose::from_matrix(Eigen::Quaterniond(T.linear()).normalized().toRotationMatrix(), T.translation());
}

/// One rectified grey-scale stereo pair (CV_8UC1, equal sizes).
struct StereoFrame {
  std::size_t index = 0;      ///< from 0: in the recording as read, among the processed frames in the SLAM
  std::int64_t stamp_ns = 0;  ///< when both images were taken
  cv::Mat left;               ///< of the left camera; black if there is none
  cv::Mat right;              ///< of the right camera; black if there is none
  std::string left_fault{};   ///< why there is no left image; empty if there is one
  std::string right_fault{};  ///< why there is no right image
  std::optional<ImuReadings> imu{};  ///< of an IMU, if there is one that is to be used

  /// Whether the left image could be read.
  [[nodiscard]] bool has_left() const { return left_fault.empty(); }
  /// Whether the right image could be read.
  [[nodiscard]] bool has_right() const { return right_fault.empty(); }
};

using Descriptor = std::array<std::uint8_t, 32>;  ///< 256-bit ORB descriptor

/// Corner in one image, with its descriptor.
struct Feature {
  Vector2<double> position_px;  ///< at full resolution
  double response = 0.0;        ///< strength of the corner
  Descriptor descriptor{};      ///< of its surroundings
};

/// Stereo measurement z = (u_left, v, disparity), eq. 12.
using StereoPoint = Vector3<double>;

/// How far the pose of a frame can be trusted.
enum class TrackingStatus {
  kInitializing,  ///< the frame that starts the map and defines the world frame
  kOk,            ///< updated by landmarks, or by the odometry if the settings ask for no more
  kWeak,          ///< measured, but with one of WeakReasons
  kLost,          ///< predicted only: the covariance grows
  kRelocalised,   ///< first frame after a loss whose place in the map is known again
};

/// Why the pose of a frame is less certain than its covariance says. Each makes the status kWeak, except that
/// a segment that began after a short gap has a covariance that allows for the gap.
struct WeakReasons {
  bool odometry_alone = false;         ///< no landmarks measured it
  bool imu_alone = false;              ///< no image measured it, but an IMU did
  bool imu_contradicted = false;       ///< the IMU, which had a part in earlier poses, contradicts the images
  bool few_landmarks = false;          ///< so few that they may agree by chance
  bool repeated_image = false;         ///< the image is that of the frame before; the pose is predicted
  bool repetitive_scene = false;       ///< the reference keyframe shows one pattern many times
  bool right_image_unfit = false;      ///< it does not fit the left one, or others did not shortly before
  bool right_camera_turned = false;    ///< that was noticed, and happened a few frames or keyframes before
  bool segment_not_localised = false;  ///< the place of the map segment in the world is not known yet
  bool sudden_motion = false;          ///< one that most points did not share began, and still do not share
};

/// The name in the result files: "OK", say.
[[nodiscard]] constexpr const char* to_string(TrackingStatus status) noexcept {
  switch (status) {
    case TrackingStatus::kInitializing:
      return "INITIALIZING";
    case TrackingStatus::kOk:
      return "OK";
    case TrackingStatus::kWeak:
      return "WEAK";
    case TrackingStatus::kLost:
      return "LOST";
    case TrackingStatus::kRelocalised:
      return "RELOCALISED";
  }
  return "UNKNOWN";
}

/// One flag of WeakReasons, and what it is called.
struct WeakReason {
  bool WeakReasons::*flag;  ///< the member
  const char* name;         ///< in the result files
  const char* text;         ///< in plain words
};

/// All reasons, in the order in which they are written.
inline constexpr std::array kWeakReasons = {
    WeakReason{&WeakReasons::odometry_alone, "odometry_alone", "odometry without landmarks"},
    WeakReason{&WeakReasons::imu_alone, "imu_alone", "IMU without images"},
    WeakReason{&WeakReasons::imu_contradicted, "imu_contradicted", "the IMU contradicted the images"},
    WeakReason{&WeakReasons::few_landmarks, "few_landmarks", "few landmarks"},
    WeakReason{&WeakReasons::repeated_image, "repeated_image", "the same image again"},
    WeakReason{&WeakReasons::repetitive_scene, "repetitive_scene", "repetitive scene"},
    WeakReason{&WeakReasons::right_image_unfit, "right_image_unfit", "right image missing or in doubt"},
    WeakReason{&WeakReasons::right_camera_turned, "right_camera_turned", "right camera turned"},
    WeakReason{&WeakReasons::segment_not_localised, "segment_not_localised", "place in the map unknown"},
    WeakReason{&WeakReasons::sudden_motion, "sudden_motion", "sudden motion that few points show"},
};
static_assert(kWeakReasons.size() * sizeof(bool) == sizeof(WeakReasons), "every reason has a name");

/// The names of the reasons that hold: "few_landmarks;segment_not_localised", say. Empty if none does.
[[nodiscard]] inline std::string to_string(const WeakReasons& weak) {
  std::string names;
  for (const auto& reason : kWeakReasons) {
    if (!(weak.*reason.flag)) continue;
    if (!names.empty()) names += ';';
    names += reason.name;
  }
  return names;
}

/// Pose with the covariance of its right perturbation: T = pose * exp(xi), xi = (rotation, translation) in
/// rad and m.
using PoseGaussian = antipode::PoseGaussian<double>;

/// Radial distortion that is left in the rectified images, as learned while driving: an exact pinhole camera
/// sees (X, Y) (1 + k1 r^2 + k2 r^4) where the images show (X, Y), in focal lengths.
struct LensEstimate {
  Vector2<double> k = Vector2<double>::Zero();      ///< k1, k2
  Vector2<double> sigma = Vector2<double>::Zero();  ///< their standard deviations
};

/// The time by which right images are exposed later than left ones, as learned while driving. Negative if
/// they are earlier.
struct DelayEstimate {
  double seconds = 0.0;  ///< right after left
  double sigma_s = 0.0;  ///< standard deviation
};

/// Standard deviations of the errors that all frames share.
struct CalibrationError {
  double scale_sigma = 0.0;       ///< relative, of all lengths
  double axes_sigma_rad = 0.0;    ///< of the camera's axes, about each of them
  double common_error_rad = 0.0;  ///< of the error that all links have in common (LinkedPose)
};

/// Milliseconds a stage took.
struct StageTime {
  std::string stage;  ///< its name
  double ms = 0.0;    ///< wall-clock time
};

/// Result of one frame. Every input frame has one.
struct FrameResult {
  std::size_t index = 0;                                  ///< number of frames processed before this one
  std::int64_t stamp_ns = 0;                              ///< when the images were taken
  TrackingStatus status = TrackingStatus::kInitializing;  ///< what the pose is based on
  WeakReasons weak{};             ///< why the status is kWeak; for other statuses, what else was noticed
  PoseGaussian T_world_camera{};  ///< of the rectified left camera
  Pose T_odometry_camera = Pose::identity();  ///< without loop corrections: continuous
  bool loop_corrected = false;                ///< a loop moved the keyframes before this frame was tracked
  std::size_t segment = 0;   ///< map segment: a loss begins a new one if nothing is recognised
  std::size_t keyframe = 0;  ///< frame of the reference keyframe; for a new keyframe, of the one before it
  /// Of the pose relative to the keyframe. Of the errors of `calibration` it contains only the uncertainty of
  /// the disparity offset.
  Matrix6<double> relative_covariance = Matrix6<double>::Zero();
  CalibrationError calibration{};  ///< errors that the covariance of T_world_camera includes
  PoseGaussian odometry{};         ///< T_previous_current, the system input u_k
  int features = 0;   ///< points that the odometry follows; with `--preset paper`, features of the left image
  int landmarks = 0;  ///< in the local map, after the frame
  int matches = 0;    ///< landmarks that were found in the frame
  bool is_keyframe = false;        ///< whether the frame became a keyframe
  bool right_image_fits = true;    ///< false: of another moment than the left one, or covered
  double nis = 0.0;                ///< normalised innovation squared of the pose update
  int nis_dof = 0;                 ///< its degrees of freedom
  InertialEstimate inertial{};     ///< velocity, gravity and biases by an IMU, if there is one
  std::vector<StageTime> times{};  ///< of the stages of this frame
};

/// A loop that consecutive keyframes confirmed.
struct LoopEvent {
  std::size_t frame = 0;       ///< the later frame
  std::size_t old_frame = 0;   ///< earlier frame at the same place
  bool in_loaded_map = false;  ///< old_frame is one of the loaded map, not of this run
  int inliers = 0;             ///< points that agree with T_old_new
  double chi2 = 0.0;  ///< squared Mahalanobis distance from the pose graph's prediction, 6 degrees of freedom
  bool accepted = false;              ///< whether chi2 is small enough for the pose graph to take it
  Pose T_old_new = Pose::identity();  ///< as measured
};

/// A landmark of the local map in the last frame.
struct LandmarkTrack {
  std::uint32_t id = 0;     ///< the same in all frames
  Vector2<double> left_px;  ///< in the left image: measured if found, else predicted
  double depth_m = 0.0;     ///< of its mean, along the camera's z axis
  int observations = 1;     ///< frames in which it was found
  bool found = false;       ///< in the last frame
};

/// Landmark of a map.
struct MapPoint {
  Vector3<double> position_world;  ///< m, in world coordinates
  std::uint8_t intensity = 0;      ///< grey value in the keyframe, 0 to 255
  std::size_t keyframe = 0;        ///< id in the map: the point moves with it
  std::uint32_t landmark = 0;      ///< its id in the map; 0: none
};

}  // namespace stereo_slam
