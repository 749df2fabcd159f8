// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include <Eigen/Geometry>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/ros2_output/mcap_writer.hpp"
#include "stereo_slam/ros2_output/messages.hpp"
#include "stereo_slam/ros2_output/odometry_covariance.hpp"

namespace stereo_slam {

/// What the messages of a frame are made of. Poses are those of the camera, T_world_camera.
struct FrameOutput {
  FrameResult result;
  double total_ms = 0.0;                              ///< of processing the frame
  std::vector<Vector3<float>> new_landmarks_world{};  ///< m
  std::vector<StampedPose> path{};                    ///< after a loop: the keyframes so far, corrected
  std::vector<std::uint8_t> jpeg{};                   ///< of the left image; empty without one
};

/// The results of a run as messages of ROS 2 on the topics that docs/guides/ros2_robot.md lists.
///
/// The coordinate frames are those of REP 105: map -> odom -> base_link -> camera_optical_frame. The base is
/// the body of the calibration. Without one it is called camera_link: the place of the left camera, with x
/// forward, y left and z up (REP 103). `map` is the first pose of the base, or the map that was loaded.
/// The log time of a message is the stamp of its frame.
///
/// With an IMU there is imu_link, too, in whose axes gravity and the biases are.
class RunMessages {
 public:
  /// Without T_body_camera the base is camera_link, and without T_camera_imu there is no IMU. `writer` must
  /// outlive the object.
  RunMessages(McapWriter& writer, const std::optional<Eigen::Isometry3d>& T_body_camera, bool with_images,
              const std::optional<Pose>& T_camera_imu = std::nullopt);

  /// Throws std::invalid_argument for a stamp that ROS 2 does not have.
  void add(const FrameOutput& frame);

  /// Adds the final path and map of the run.
  void add_final(std::span<const StampedPose> path, std::span<const Vector3<float>> map_world);

 private:
  struct Channels {
    std::uint16_t odometry = 0;
    std::uint16_t pose = 0;
    std::uint16_t path = 0;
    std::uint16_t transforms = 0;
    std::uint16_t static_transforms = 0;
    std::uint16_t diagnostics = 0;
    std::uint16_t landmarks = 0;
    std::uint16_t map = 0;
    std::uint16_t image = 0;
    std::uint16_t gravity = 0;
    std::uint16_t gyroscope_bias = 0;
    std::uint16_t accelerometer_bias = 0;
  };

  void add_motion(const FrameResult& camera);
  void add_static_transform(std::int64_t stamp_ns);
  void add_path(std::int64_t stamp_ns, std::span<const StampedPose> path_of_camera);
  void add_points(std::uint16_t channel, std::int64_t stamp_ns, std::span<const Vector3<float>> points_world);
  void add_inertial(std::int64_t stamp_ns, const InertialEstimate& estimate);
  void set_velocity(const FrameResult& base, RosOdometry& odometry) const;
  void set_inertial_velocity(const InertialEstimate& estimate, RosOdometry& odometry) const;

  McapWriter& writer_;
  Eigen::Isometry3d T_base_camera_;
  Pose X_;                 // the same; the pose of the camera in the world is X^-1 T_map_base X
  std::string_view base_;  // name of the frame
  std::optional<Pose> T_base_imu_;
  Channels channels_;
  OdometryCovariance odometry_covariance_;
  std::optional<StampedPose> previous_;  // T_odom_base of the frame before
};

}  // namespace stereo_slam
