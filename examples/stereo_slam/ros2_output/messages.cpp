// SPDX-License-Identifier: MIT
#include "stereo_slam/ros2_output/messages.hpp"

#include <array>
#include <cstring>
#include <utility>

#include <fmt/format.h>

#include <antipode/distributions/covariance_conventions.hpp>

#include "stereo_slam/ros2_output/cdr_writer.hpp"

namespace stereo_slam {
namespace {

CdrWriter& put_header(CdrWriter& cdr, const RosHeader& header) {
  return cdr.put_header(header.stamp_ns, header.frame);
}

void put_vector(CdrWriter& cdr, const Vector3<double>& v) { cdr.put(v.x()).put(v.y()).put(v.z()); }

/// geometry_msgs/Pose, or Transform, which has the same fields.
void put_pose(CdrWriter& cdr, const Pose& pose) {
  put_vector(cdr, pose.translation());
  const antipode::Vector4<double> q = antipode::canonical(pose.rotation());  // w, x, y, z
  cdr.put(q[1]).put(q[2]).put(q[3]).put(q[0]);
}

void put_covariance(CdrWriter& cdr, const std::array<double, 36>& rows) {
  for (const double x : rows) cdr.put(x);
}

void put_pose_with_covariance(CdrWriter& cdr, const PoseGaussian& pose) {
  put_pose(cdr, pose.pose);
  put_covariance(cdr, antipode::to_ros_covariance(pose));
}

/// geometry_msgs/TwistWithCovariance or AccelWithCovariance, which have the linear part first.
void put_twist_with_covariance(CdrWriter& cdr, const Vector6<double>& velocity, const Matrix6<double>& P) {
  put_vector(cdr, velocity.tail<3>());
  put_vector(cdr, velocity.head<3>());
  // Both parts are in the axes of the child frame, so nothing is turned.
  put_covariance(cdr, antipode::to_ros_covariance(PoseGaussian{Pose::identity(), P}));
}

/// A stamped twist or acceleration; `begin` is the row of the part that is known: 0 the angular, 3 the
/// linear.
[[nodiscard]] CdrMessage part_message(const RosHeader& header, const UncertainVector& part, int begin) {
  Vector6<double> both = Vector6<double>::Zero();
  Matrix6<double> P = Matrix6<double>::Zero();
  both.segment<3>(begin) = part.value;
  P.block<3, 3>(begin, begin) = part.covariance;
  CdrWriter cdr;
  put_header(cdr, header);
  put_twist_with_covariance(cdr, both, P);
  return cdr.take();
}

[[nodiscard]] std::uint8_t level_of(TrackingStatus status) {
  constexpr std::uint8_t kOk = 0, kWarn = 1, kError = 2;
  switch (status) {
    case TrackingStatus::kLost:
      return kError;
    case TrackingStatus::kWeak:
      return kWarn;
    case TrackingStatus::kInitializing:
    case TrackingStatus::kOk:
    case TrackingStatus::kRelocalised:
      break;
  }
  return kOk;
}

/// The status and its reasons in words: "WEAK: few landmarks, repetitive scene".
[[nodiscard]] std::string in_words(const FrameResult& result) {
  std::string text = to_string(result.status);
  const char* separator = ": ";
  for (const auto& reason : kWeakReasons) {
    if (!(result.weak.*reason.flag)) continue;
    text += std::exchange(separator, ", ");
    text += reason.text;
  }
  return text;
}

}  // namespace

CdrMessage odometry_message(const RosOdometry& odometry) {
  CdrWriter cdr;
  put_header(cdr, odometry.header).put(odometry.child);
  put_pose_with_covariance(cdr, odometry.pose);
  put_twist_with_covariance(cdr, odometry.velocity, odometry.P_velocity);
  return cdr.take();
}

CdrMessage pose_message(const RosHeader& header, const PoseGaussian& pose) {
  CdrWriter cdr;
  put_header(cdr, header);
  put_pose_with_covariance(cdr, pose);
  return cdr.take();
}

CdrMessage acceleration_message(const RosHeader& header, const UncertainVector& linear) {
  return part_message(header, linear, 3);
}

CdrMessage rate_message(const RosHeader& header, const UncertainVector& angular) {
  return part_message(header, angular, 0);
}

CdrMessage transforms_message(std::span<const RosTransform> transforms) {
  CdrWriter cdr;
  cdr.put_count(transforms.size());
  for (const auto& transform : transforms) {
    put_header(cdr, transform.header).put(transform.child);
    put_pose(cdr, transform.T_parent_child);
  }
  return cdr.take();
}

CdrMessage path_message(const RosHeader& header, std::span<const StampedPose> poses) {
  CdrWriter cdr;
  put_header(cdr, header).put_count(poses.size());
  for (const auto& [stamp_ns, pose] : poses) {
    put_header(cdr, {stamp_ns, header.frame});
    put_pose(cdr, pose);
  }
  return cdr.take();
}

CdrMessage points_message(const RosHeader& header, std::span<const Vector3<float>> points) {
  constexpr std::uint8_t kFloat32 = 7;  // of sensor_msgs/PointField
  static_assert(sizeof(Vector3<float>) == 3 * sizeof(float));
  const std::size_t step_bytes = sizeof(Vector3<float>);
  CdrWriter cdr;
  put_header(cdr, header);
  cdr.put(std::uint32_t{1}).put(static_cast<std::uint32_t>(points.size()));  // height, width: no image
  constexpr std::array kNames = {"x", "y", "z"};
  cdr.put_count(kNames.size());
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    cdr.put(kNames[i]).put(static_cast<std::uint32_t>(i * sizeof(float)));
    cdr.put(kFloat32).put(std::uint32_t{1});
  }
  cdr.put(std::uint8_t{0});  // is_bigendian
  cdr.put(static_cast<std::uint32_t>(step_bytes)).put(static_cast<std::uint32_t>(points.size() * step_bytes));
  cdr.put(std::span(reinterpret_cast<const std::uint8_t*>(points.data()), points.size() * step_bytes));
  cdr.put(std::uint8_t{1});  // is_dense: no point is invalid
  return cdr.take();
}

CdrMessage jpeg_message(const RosHeader& header, std::span<const std::uint8_t> jpeg) {
  CdrWriter cdr;
  put_header(cdr, header).put("jpeg").put(jpeg);
  return cdr.take();
}

CdrMessage diagnostics_message(const FrameResult& result, double total_ms) {
  std::vector<std::pair<std::string, std::string>> values = {
      {"status", to_string(result.status)},
      {"reasons", to_string(result.weak)},
      {"frame", fmt::to_string(result.index)},
      {"keyframe", fmt::to_string(result.keyframe)},
      {"map segment", fmt::to_string(result.segment)},
      {"landmarks", fmt::to_string(result.landmarks)},
      {"matches", fmt::to_string(result.matches)},
      {"features", fmt::to_string(result.features)},
      {"nis", fmt::format("{:.6g}", result.nis)},
      {"nis_dof", fmt::to_string(result.nis_dof)},
      {"total_ms", fmt::format("{:.3f}", total_ms)},
  };
  for (const auto& [stage, ms] : result.times) values.emplace_back(stage + "_ms", fmt::format("{:.3f}", ms));
  CdrWriter cdr;
  put_header(cdr, {result.stamp_ns, ""});  // of no frame
  cdr.put_count(1).put(level_of(result.status)).put("stereo_slam: tracking").put(in_words(result)).put("");
  cdr.put_count(values.size());
  for (const auto& [key, value] : values) cdr.put(key).put(value);
  return cdr.take();
}

}  // namespace stereo_slam
