// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "stereo_slam/core/types.hpp"

/// Messages of ROS 2 as CDR. The functions throw std::invalid_argument for stamps that ROS 2 does not have.
namespace stereo_slam {

using CdrMessage = std::vector<std::uint8_t>;

/// The coordinate frames of the messages, as REP 105 names them, and `camera_optical_frame` as in REP 103:
/// x right, y down, z forward.
inline constexpr std::string_view kMapFrame = "map";
inline constexpr std::string_view kOdometryFrame = "odom";
inline constexpr std::string_view kOpticalFrame = "camera_optical_frame";
inline constexpr std::string_view kImuFrame = "imu_link";  ///< the axes of the IMU

/// What a message says of itself.
struct RosHeader {
  std::int64_t stamp_ns = 0;
  std::string_view frame;
};

/// A nav_msgs/msg/Odometry. `velocity` has the distance and the angle per second as its pose's logarithm, in
/// the axes of `child`.
struct RosOdometry {
  RosHeader header;
  std::string_view child;
  PoseGaussian pose;           ///< T_frame_child
  Vector6<double> velocity;    ///< (angular, linear), rad/s and m/s, in the axes of `child`
  Matrix6<double> P_velocity;  ///< its covariance
};
[[nodiscard]] CdrMessage odometry_message(const RosOdometry& odometry);

/// A geometry_msgs/msg/PoseWithCovarianceStamped.
[[nodiscard]] CdrMessage pose_message(const RosHeader& header, const PoseGaussian& pose);

/// Three numbers with their covariance.
struct UncertainVector {
  Vector3<double> value;
  Matrix3<double> covariance;
};

/// A geometry_msgs/msg/AccelWithCovarianceStamped of a linear acceleration. Its angular part is zero and
/// means nothing.
[[nodiscard]] CdrMessage acceleration_message(const RosHeader& header, const UncertainVector& linear);

/// A geometry_msgs/msg/TwistWithCovarianceStamped of an angular velocity. Its linear part is zero and means
/// nothing.
[[nodiscard]] CdrMessage rate_message(const RosHeader& header, const UncertainVector& angular);

/// A transform of tf: T_parent_child.
struct RosTransform {
  RosHeader header;  ///< its frame is the parent
  std::string_view child;
  Pose T_parent_child;
};
/// A tf2_msgs/msg/TFMessage.
[[nodiscard]] CdrMessage transforms_message(std::span<const RosTransform> transforms);

struct StampedPose {
  std::int64_t stamp_ns = 0;
  Pose pose;
};
/// A nav_msgs/msg/Path.
[[nodiscard]] CdrMessage path_message(const RosHeader& header, std::span<const StampedPose> poses);

/// A sensor_msgs/msg/PointCloud2 with the fields x, y and z (float32, m).
[[nodiscard]] CdrMessage points_message(const RosHeader& header, std::span<const Vector3<float>> points);

/// A sensor_msgs/msg/CompressedImage.
[[nodiscard]] CdrMessage jpeg_message(const RosHeader& header, std::span<const std::uint8_t> jpeg);

/// A diagnostic_msgs/msg/DiagnosticArray with the status of a frame, why it is WEAK, counts, and times in ms:
/// OK for the statuses OK, INITIALIZING and RELOCALISED, WARN for WEAK and ERROR for LOST.
[[nodiscard]] CdrMessage diagnostics_message(const FrameResult& result, double total_ms);

}  // namespace stereo_slam
