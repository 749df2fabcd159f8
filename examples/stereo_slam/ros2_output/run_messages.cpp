// SPDX-License-Identifier: MIT
#include "stereo_slam/ros2_output/run_messages.hpp"

#include <array>
#include <string>
#include <vector>

#include "stereo_slam/core/pose_estimate.hpp"
#include "stereo_slam/results/pose_frame.hpp"
#include "stereo_slam/ros2_output/message_definitions.hpp"

namespace stereo_slam {
namespace {

/// Quality of service of topics whose last message late subscribers get, in the form of rosbag2: keep the
/// last one (1), reliable (1), transient local (1), no deadlines, automatic liveliness (1).
constexpr std::string_view kLatched = R"(- history: 1
  depth: 1
  reliability: 1
  durability: 1
  deadline:
    sec: 9223372036
    nsec: 854775807
  lifespan:
    sec: 9223372036
    nsec: 854775807
  liveliness: 1
  liveliness_lease_duration:
    sec: 9223372036
    nsec: 854775807
  avoid_ros_namespace_conventions: false
)";

[[nodiscard]] std::uint16_t add_topic(McapWriter& writer, const std::string& name, const std::string& type,
                                      std::string_view qos = "") {
  return writer.add_topic({name, type, ros2_definition(type), std::string(qos)});
}

/// T_link_optical of REP 103: the link has x forward, y left and z up, the optical frame x right, y down and
/// z forward.
[[nodiscard]] Eigen::Isometry3d optical_frame_in_link() {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() << 0.0, 0.0, 1.0,  //
      -1.0, 0.0, 0.0,           //
      0.0, -1.0, 0.0;
  return T;
}

}  // namespace

RunMessages::RunMessages(McapWriter& writer, const std::optional<Eigen::Isometry3d>& T_body_camera,
                         bool with_images, const std::optional<Pose>& T_camera_imu)
    : writer_(writer),
      T_base_camera_(T_body_camera.value_or(optical_frame_in_link())),
      X_(to_pose(T_base_camera_)),
      base_(T_body_camera ? "base_link" : "camera_link") {
  channels_.odometry = add_topic(writer_, "/stereo_slam/odometry", "nav_msgs/msg/Odometry");
  channels_.pose = add_topic(writer_, "/stereo_slam/pose", "geometry_msgs/msg/PoseWithCovarianceStamped");
  channels_.path = add_topic(writer_, "/stereo_slam/path", "nav_msgs/msg/Path", kLatched);
  channels_.transforms = add_topic(writer_, "/tf", "tf2_msgs/msg/TFMessage");
  channels_.static_transforms = add_topic(writer_, "/tf_static", "tf2_msgs/msg/TFMessage", kLatched);
  channels_.diagnostics = add_topic(writer_, "/diagnostics", "diagnostic_msgs/msg/DiagnosticArray");
  channels_.landmarks = add_topic(writer_, "/stereo_slam/landmarks", "sensor_msgs/msg/PointCloud2");
  channels_.map = add_topic(writer_, "/stereo_slam/map", "sensor_msgs/msg/PointCloud2", kLatched);
  if (with_images)
    channels_.image = add_topic(writer_, "/stereo_slam/left/compressed", "sensor_msgs/msg/CompressedImage");
  if (!T_camera_imu) return;
  T_base_imu_ = (X_ * *T_camera_imu).renormalized();
  const std::string acceleration = "geometry_msgs/msg/AccelWithCovarianceStamped";
  channels_.gravity = add_topic(writer_, "/stereo_slam/imu/gravity", acceleration);
  channels_.accelerometer_bias = add_topic(writer_, "/stereo_slam/imu/accelerometer_bias", acceleration);
  channels_.gyroscope_bias =
      add_topic(writer_, "/stereo_slam/imu/gyroscope_bias", "geometry_msgs/msg/TwistWithCovarianceStamped");
}

void RunMessages::add(const FrameOutput& frame) {
  const std::int64_t stamp_ns = frame.result.stamp_ns;
  const auto diagnostics = diagnostics_message(frame.result, frame.total_ms);  // refuses a wrong stamp first
  if (!previous_) add_static_transform(stamp_ns);
  add_motion(frame.result);
  add_inertial(stamp_ns, frame.result.inertial);
  writer_.add(channels_.diagnostics, stamp_ns, diagnostics);
  if (!frame.new_landmarks_world.empty())
    add_points(channels_.landmarks, stamp_ns, frame.new_landmarks_world);
  if (!frame.path.empty()) add_path(stamp_ns, frame.path);
  if (!frame.jpeg.empty())
    writer_.add(channels_.image, stamp_ns, jpeg_message({stamp_ns, kOpticalFrame}, frame.jpeg));
}

void RunMessages::add_final(std::span<const StampedPose> path, std::span<const Vector3<float>> map_world) {
  if (!previous_) return;  // no frame was processed
  add_path(previous_->stamp_ns, path);
  add_points(channels_.map, previous_->stamp_ns, map_world);
}

/// Adds where the base is in both frames, and how fast it moves.
void RunMessages::add_motion(const FrameResult& camera) {
  const FrameResult base = in_body_frame(camera, T_base_camera_);
  const std::int64_t stamp_ns = base.stamp_ns;
  RosOdometry odometry{.header = {stamp_ns, kOdometryFrame},
                       .child = base_,
                       .pose = in_body_frame(odometry_covariance_.next(camera), T_base_camera_),
                       .velocity = Vector6<double>::Zero(),
                       .P_velocity = unknown_pose_covariance()};
  set_velocity(base, odometry);
  set_inertial_velocity(camera.inertial, odometry);
  const Pose& T_odom_base = base.T_odometry_camera;
  const Pose T_map_odom = (base.T_world_camera.pose * T_odom_base.inverse()).renormalized();
  writer_.add(channels_.odometry, stamp_ns, odometry_message(odometry));
  writer_.add(channels_.pose, stamp_ns, pose_message({stamp_ns, kMapFrame}, base.T_world_camera));
  writer_.add(channels_.transforms, stamp_ns,
              transforms_message(std::array{RosTransform{{stamp_ns, kMapFrame}, kOdometryFrame, T_map_odom},
                                            RosTransform{{stamp_ns, kOdometryFrame}, base_, T_odom_base}}));
  previous_ = {stamp_ns, T_odom_base};
}

/// Sets the velocity since the frame before: as the odometry measured it, or, where it did not, that of the
/// predicted pose, of which nothing is known.
void RunMessages::set_velocity(const FrameResult& base, RosOdometry& odometry) const {
  if (!previous_ || base.stamp_ns <= previous_->stamp_ns) return;
  const double seconds = 1e-9 * static_cast<double>(base.stamp_ns - previous_->stamp_ns);
  const bool measured = base.status != TrackingStatus::kLost && !base.odometry.covariance.isZero(0.0);
  const Pose T_previous_now =
      measured ? base.odometry.pose : (previous_->pose.inverse() * base.T_odometry_camera).renormalized();
  odometry.velocity = T_previous_now.log() / seconds;
  odometry.P_velocity =
      (measured ? base.odometry.covariance : unknown_pose_covariance()) / (seconds * seconds);
}

/// Takes the linear velocity from the IMU, if there is one: that of the base at the time of the frame, not
/// the mean since the frame before. The base moves with the IMU: v_imu = v_base + w x t, all in its axes.
void RunMessages::set_inertial_velocity(const InertialEstimate& estimate, RosOdometry& odometry) const {
  if (!T_base_imu_ || estimate.phase != InertialPhase::kRunning) return;
  const Matrix3<double> R = T_base_imu_->rotation_matrix();
  const Vector3<double> t = T_base_imu_->translation(), w = odometry.velocity.head<3>();
  odometry.velocity.tail<3>() = R * estimate.velocity - w.cross(t);
  Matrix3<double> lever;  // d (t x w) / d w
  lever << 0.0, -t.z(), t.y(), t.z(), 0.0, -t.x(), -t.y(), t.x(), 0.0;
  const Matrix3<double> P_w = odometry.P_velocity.topLeftCorner<3, 3>();
  odometry.P_velocity.bottomLeftCorner<3, 3>() = lever * P_w;
  odometry.P_velocity.topRightCorner<3, 3>() = P_w * lever.transpose();
  odometry.P_velocity.bottomRightCorner<3, 3>() =
      R * estimate.covariance.topLeftCorner<3, 3>() * R.transpose() + lever * P_w * lever.transpose();
}

/// Adds what the IMU told of a frame besides its velocity.
void RunMessages::add_inertial(std::int64_t stamp_ns, const InertialEstimate& estimate) {
  if (!T_base_imu_ || estimate.phase != InertialPhase::kRunning) return;
  const RosHeader header{stamp_ns, kImuFrame};
  const auto block = [&](int begin) -> Matrix3<double> {
    return estimate.covariance.block<3, 3>(begin, begin);
  };
  writer_.add(channels_.gravity, stamp_ns, acceleration_message(header, {estimate.gravity, block(3)}));
  writer_.add(channels_.gyroscope_bias, stamp_ns,
              rate_message(header, {estimate.biases.head<3>(), block(6)}));
  writer_.add(channels_.accelerometer_bias, stamp_ns,
              acceleration_message(header, {estimate.biases.tail<3>(), block(9)}));
}

void RunMessages::add_static_transform(std::int64_t stamp_ns) {
  std::vector<RosTransform> transforms{{{stamp_ns, base_}, kOpticalFrame, X_}};
  if (T_base_imu_) transforms.push_back({{stamp_ns, base_}, kImuFrame, *T_base_imu_});
  writer_.add(channels_.static_transforms, stamp_ns, transforms_message(transforms));
}

void RunMessages::add_path(std::int64_t stamp_ns, std::span<const StampedPose> path_of_camera) {
  std::vector<StampedPose> path(path_of_camera.begin(), path_of_camera.end());
  for (auto& [stamp, pose] : path) pose = X_ * pose * X_.inverse();
  writer_.add(channels_.path, stamp_ns, path_message({stamp_ns, kMapFrame}, path));
}

void RunMessages::add_points(std::uint16_t channel, std::int64_t stamp_ns,
                             std::span<const Vector3<float>> points_world) {
  std::vector<Vector3<float>> points;
  points.reserve(points_world.size());
  for (const auto& point : points_world) points.push_back((X_ * point.cast<double>()).cast<float>());
  writer_.add(channel, stamp_ns, points_message({stamp_ns, kMapFrame}, points));
}

}  // namespace stereo_slam
