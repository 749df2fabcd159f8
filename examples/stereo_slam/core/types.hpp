// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <opencv2/core.hpp>

#include <antipode/eigen_types.hpp>
#include <antipode/distributions/pose_gaussian.hpp>
#include <antipode/geometry/dual_quaternion.hpp>

/// Data that the stages of the SLAM hand to each other. Pixels, metres, radians; `T_a_b` maps b to a.
namespace stereo_slam {

using antipode::Matrix2;
using antipode::Matrix3;
using antipode::Matrix6;
using antipode::Vector2;
using antipode::Vector3;
using antipode::Vector6;
using Matrix6x3 = antipode::Matrix<double, 6, 3>;

using Pose = antipode::DualQuaternion<double>;

/// One rectified grey-scale stereo pair (CV_8UC1, equal sizes).
struct StereoFrame {
  std::size_t index = 0;
  std::int64_t stamp_ns = 0;
  cv::Mat left;
  cv::Mat right;
};

using Descriptor = std::array<std::uint8_t, 32>;  ///< 256-bit ORB descriptor

/// Corner in one image.
struct Feature {
  Vector2<double> position_px;  ///< at full resolution
  double size_px = 31.0;        ///< diameter of the described patch
  double angle_rad = 0.0;
  double response = 0.0;
  int octave = 0;
  Descriptor descriptor{};
};

/// Stereo measurement z = (u_left, v, disparity), eq. 12.
using StereoPoint = Vector3<double>;

/// How far the pose of a frame can be trusted.
enum class TrackingStatus {
  kInitializing,  ///< nothing was seen yet that a map could begin with; the world begins at its end
  kOk,            ///< measured against the landmarks
  kWeak,  ///< by the odometry alone; the same picture again; or, after a loss, its place in the map is a
          ///< guess
  kLost,  ///< by neither: predicted, with a covariance that grows
  kRelocalised,  ///< found again after a loss: from here on its place in the map is known
};

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

/// Pose with the covariance of its right perturbation: T = pose * exp(xi), xi = (rotation, translation) in
/// rad and m.
using PoseGaussian = antipode::PoseGaussian<double>;

/// Standard deviations of what a calibration does not know: the same errors in all frames.
struct CalibrationError {
  double scale_sigma = 0.0;     ///< relative, of all lengths
  double axes_sigma_rad = 0.0;  ///< of the camera's axes, about each of them
};

/// Milliseconds a stage took.
struct StageTime {
  std::string stage;
  double ms = 0.0;
};

/// What one frame came to. Every input frame has one.
struct FrameResult {
  std::size_t index = 0;
  std::int64_t stamp_ns = 0;
  TrackingStatus status = TrackingStatus::kInitializing;
  PoseGaussian T_world_camera;
  Pose T_odometry_camera = Pose::identity();  ///< without any loop correction: it never jumps
  bool loop_corrected = false;                ///< a loop moved the keyframes before this frame
  std::size_t segment = 0;   ///< of the map: a new one begins where nothing is recognised after a loss
  std::size_t keyframe = 0;  ///< frame whose camera the filter's state was relative to
  Matrix6<double> relative_covariance = Matrix6<double>::Zero();  ///< of the pose relative to that camera,
                                                                  ///< without the calibration's errors
  CalibrationError calibration;
  PoseGaussian odometry;  ///< T_previous_current, the system input u_k
  int features = 0;
  int landmarks = 0;
  int matches = 0;
  bool is_keyframe = false;
  double nis = 0.0;  ///< normalised innovation squared of the pose update
  int nis_dof = 0;
  std::vector<StageTime> times;
};

/// A place seen again, in two or more keyframes in a row.
struct LoopEvent {
  std::size_t frame = 0;
  std::size_t old_frame = 0;   ///< of the run, or of the map that it started with
  bool in_loaded_map = false;  ///< the latter
  int inliers = 0;
  double chi2 = 0.0;  ///< by which it contradicts what was known, six degrees of freedom
  bool accepted = false;
  Pose T_old_new = Pose::identity();  ///< as measured
};

/// Landmark of a map.
struct MapPoint {
  Vector3<double> position_world;
  std::uint8_t intensity = 0;
  std::size_t keyframe = 0;    ///< id of the one that it moves with, in the map
  std::uint32_t landmark = 0;  ///< its number, in the map; 0: none
};

}  // namespace stereo_slam
