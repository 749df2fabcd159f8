// SPDX-License-Identifier: MIT
#include <string>
#include <vector>

#include "stereo_slam/calibration/calibration_formats.hpp"
#include "stereo_slam/calibration/lens_values.hpp"
#include "stereo_slam/calibration/yaml_map.hpp"

namespace stereo_slam {
namespace {

/// The two first entries of a list of `map`, which has one per camera.
[[nodiscard]] std::vector<YAML::Node> first_two(const YamlMap& map, const char* key) {
  const YAML::Node list = map.get({key});
  if (!list.IsSequence() || list.size() < 2)
    map.fail(list, "{} is not of two cameras; calibrate them as a stereo pair", key);
  return {list[0], list[1]};
}

[[nodiscard]] Lens read_basalt_lens(const YamlMap& camera, const YAML::Node& resolution) {
  const Fail fail_here = [&](const std::string& what) { camera.fail(what); };
  const std::string type = camera.text({"camera_type"});
  const YamlMap values = camera.map("intrinsics");
  Lens lens;
  std::vector<double> size;
  for (const auto& side : resolution) size.push_back(side.as<double>(0.0));
  set_size(lens, size, fail_here);
  set_pinhole(lens, {values.number("fx"), values.number("fy"), values.number("cx"), values.number("cy")},
              fail_here);
  if (type == "pinhole") return lens;
  if (type == "kb4") {
    set_model(lens, "equidistant", fail_here);
    set_coefficients(lens,
                     {values.number("k1"), values.number("k2"), values.number("k3"), values.number("k4")},
                     fail_here);
  } else if (type == "pinhole-radtan8") {
    set_model(lens, "radtan", fail_here);
    std::vector<double> coefficients;
    for (const char* key : {"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"})
      coefficients.push_back(values.number(key));
    set_coefficients(lens, coefficients, fail_here);
  } else {
    camera.fail(
        "camera_type is {}, but must be kb4, pinhole or pinhole-radtan8; calibrate with basalt_calibrate "
        "--cam-types kb4 kb4",
        type);
  }
  return lens;
}

[[nodiscard]] Eigen::Isometry3d read_basalt_pose(const YamlMap& pose) {
  constexpr double kTolerance = 1e-2;
  const Eigen::Quaterniond q(pose.number("qw"), pose.number("qx"), pose.number("qy"), pose.number("qz"));
  if (!(std::abs(q.norm() - 1.0) < kTolerance))
    pose.fail("qx, qy, qz, qw of T_imu_cam are not of a rotation");
  return Eigen::Translation3d(pose.number("px"), pose.number("py"), pose.number("pz")) * q.normalized();
}

}  // namespace

OwnCamera read_basalt(const CalibrationText& text) {
  const YamlMap root = YamlMap(text.file, text.root(), "the file").map("value0");
  const auto intrinsics = first_two(root, "intrinsics");
  const auto resolution = first_two(root, "resolution");
  const auto poses = first_two(root, "T_imu_cam");
  const auto map = [&](const YAML::Node& node, const char* name) { return YamlMap(text.file, node, name); };
  StereoRig rig;
  rig.left = read_basalt_lens(map(intrinsics[0], "intrinsics"), resolution[0]);
  rig.right = read_basalt_lens(map(intrinsics[1], "intrinsics"), resolution[1]);
  rig.T_body_left = read_basalt_pose(map(poses[0], "T_imu_cam"));
  rig.T_right_left = read_basalt_pose(map(poses[1], "T_imu_cam")).inverse() * *rig.T_body_left;
  OwnCamera own;
  own.rig = rig;
  return own;
}

}  // namespace stereo_slam
