// SPDX-License-Identifier: MIT
#include "stereo_slam/ros2_output/message_definitions.hpp"

#include <algorithm>
#include <array>
#include <sstream>
#include <stdexcept>
#include <vector>

#include <fmt/format.h>

namespace stereo_slam {
namespace {

struct Definition {
  std::string_view type;
  std::string_view fields;
};

/// The fields of the types, as the packages of ROS 2 define them (common_interfaces, geometry2,
/// rcl_interfaces; the same from Foxy to Jazzy), without comments.
constexpr std::array kDefinitions = {
    Definition{"builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n"},
    Definition{"std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id\n"},
    Definition{"geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n"},
    Definition{"geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n"},
    Definition{"geometry_msgs/Quaternion", "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n"},
    Definition{"geometry_msgs/Pose", "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n"},
    Definition{"geometry_msgs/PoseStamped", "std_msgs/Header header\ngeometry_msgs/Pose pose\n"},
    Definition{"geometry_msgs/PoseWithCovariance", "geometry_msgs/Pose pose\nfloat64[36] covariance\n"},
    Definition{"geometry_msgs/PoseWithCovarianceStamped",
               "std_msgs/Header header\ngeometry_msgs/PoseWithCovariance pose\n"},
    Definition{"geometry_msgs/Twist", "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n"},
    Definition{"geometry_msgs/TwistWithCovariance", "geometry_msgs/Twist twist\nfloat64[36] covariance\n"},
    Definition{"geometry_msgs/TwistWithCovarianceStamped",
               "std_msgs/Header header\ngeometry_msgs/TwistWithCovariance twist\n"},
    Definition{"geometry_msgs/Accel", "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n"},
    Definition{"geometry_msgs/AccelWithCovariance", "geometry_msgs/Accel accel\nfloat64[36] covariance\n"},
    Definition{"geometry_msgs/AccelWithCovarianceStamped",
               "std_msgs/Header header\ngeometry_msgs/AccelWithCovariance accel\n"},
    Definition{"geometry_msgs/Transform",
               "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n"},
    Definition{"geometry_msgs/TransformStamped",
               "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n"},
    Definition{"nav_msgs/Odometry",
               "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance pose\n"
               "geometry_msgs/TwistWithCovariance twist\n"},
    Definition{"nav_msgs/Path", "std_msgs/Header header\ngeometry_msgs/PoseStamped[] poses\n"},
    Definition{"tf2_msgs/TFMessage", "geometry_msgs/TransformStamped[] transforms\n"},
    Definition{"diagnostic_msgs/KeyValue", "string key\nstring value\n"},
    Definition{"diagnostic_msgs/DiagnosticStatus",
               "byte OK=0\nbyte WARN=1\nbyte ERROR=2\nbyte STALE=3\nbyte level\nstring name\n"
               "string message\nstring hardware_id\ndiagnostic_msgs/KeyValue[] values\n"},
    Definition{"diagnostic_msgs/DiagnosticArray",
               "std_msgs/Header header\ndiagnostic_msgs/DiagnosticStatus[] status\n"},
    Definition{"sensor_msgs/PointField",
               "uint8 INT8=1\nuint8 UINT8=2\nuint8 INT16=3\nuint8 UINT16=4\nuint8 INT32=5\nuint8 UINT32=6\n"
               "uint8 FLOAT32=7\nuint8 FLOAT64=8\nstring name\nuint32 offset\nuint8 datatype\n"
               "uint32 count\n"},
    Definition{"sensor_msgs/PointCloud2",
               "std_msgs/Header header\nuint32 height\nuint32 width\nsensor_msgs/PointField[] fields\n"
               "bool is_bigendian\nuint32 point_step\nuint32 row_step\nuint8[] data\nbool is_dense\n"},
    Definition{"sensor_msgs/CompressedImage", "std_msgs/Header header\nstring format\nuint8[] data\n"},
};

[[nodiscard]] const Definition& definition_of(std::string_view type) {
  const auto* const found = std::ranges::find(kDefinitions, type, &Definition::type);
  if (found == kDefinitions.end())
    throw std::invalid_argument(fmt::format("no definition of the message type '{}'", type));
  return *found;
}

/// Appends the types of the fields, and of their fields, that are not in `types` yet.
void add_types_in(const Definition& definition, std::vector<std::string_view>& types) {
  std::istringstream lines{std::string(definition.fields)};
  for (std::string line; std::getline(lines, line);) {
    const std::string type = line.substr(0, line.find_first_of(" ["));
    if (type.find('/') == type.npos) continue;
    const Definition& field = definition_of(type);
    if (std::ranges::find(types, field.type) != types.end()) continue;
    types.push_back(field.type);
    add_types_in(field, types);
  }
}

}  // namespace

std::string ros2_definition(std::string_view type) {
  std::string name(type);
  if (const auto middle = name.find("/msg/"); middle != name.npos) name.erase(middle, 4);
  const Definition& root = definition_of(name);
  std::vector<std::string_view> types;
  add_types_in(root, types);
  std::string text(root.fields);
  for (const auto& part : types)
    text += fmt::format("{:=<80}\nMSG: {}\n{}", "", part, definition_of(part).fields);
  return text;
}

}  // namespace stereo_slam
