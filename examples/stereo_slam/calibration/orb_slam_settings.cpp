// SPDX-License-Identifier: MIT
#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "stereo_slam/calibration/calibration_formats.hpp"
#include "stereo_slam/calibration/camera_info.hpp"
#include "stereo_slam/calibration/given_distortion.hpp"
#include "stereo_slam/calibration/yaml_map.hpp"
#include "stereo_slam/io/file_error.hpp"

namespace stereo_slam {
namespace {

[[nodiscard]] Fail fail_in(const YamlMap& map) {
  return [&map](const std::string& what) { map.fail(what); };
}

/// Camera.type; ORB-SLAM2 knows pinholes only and does not name them.
[[nodiscard]] std::string orb_camera_type(const YamlMap& root) {
  const YamlMap camera = root.map("Camera");
  return camera.has("type") ? camera.text({"type"}) : "PinHole";
}

[[nodiscard]] bool is_orb_fisheye(const YamlMap& root) { return orb_camera_type(root) == "KannalaBrandt8"; }

/// The coefficients that a camera has under these names; they default to zero.
[[nodiscard]] std::vector<double> orb_coefficients(const YamlMap& camera, bool fisheye) {
  if (fisheye) return {camera.number("k1"), camera.number("k2"), camera.number("k3"), camera.number("k4")};
  std::vector<double> coefficients;
  for (const char* key : {"k1", "k2", "p1", "p2", "k3"}) coefficients.push_back(camera.number_or(key, 0.0));
  return coefficients;
}

/// fx ... of a raw camera, whose size is that of `Camera`.
[[nodiscard]] Lens read_orb_lens(const YamlMap& root, const char* name) {
  const YamlMap camera = root.map(name);
  const YamlMap common = root.map("Camera");
  Lens lens;
  if (common.has("width")) set_size(lens, {common.number("width"), common.number("height")}, fail_in(common));
  set_pinhole(lens, {camera.number("fx"), camera.number("fy"), camera.number("cx"), camera.number("cy")},
              fail_in(camera));
  set_model(lens, is_orb_fisheye(root) ? "equidistant" : "radtan", fail_in(camera));
  set_coefficients(lens, orb_coefficients(camera, is_orb_fisheye(root)), fail_in(camera));
  return lens;
}

/// ORB-SLAM3: two raw cameras and the pose of the right one in the left one.
[[nodiscard]] OwnCamera read_orb_raw(const YamlMap& root, const char* left,
                                     const Eigen::Isometry3d& T_left_right) {
  StereoRig rig;
  rig.left = read_orb_lens(root, left);
  rig.right = read_orb_lens(root, "Camera2");
  rig.T_right_left = T_left_right.inverse();
  if (root.has("IMU") && root.map("IMU").has("T_b_c1")) rig.T_body_left = root.map("IMU").transform("T_b_c1");
  OwnCamera own;
  own.rig = rig;
  return own;
}

/// Rectified images, with the baseline in metres.
[[nodiscard]] OwnCamera read_orb_rectified(const YamlMap& root, const char* name, double baseline_m) {
  const YamlMap camera = root.map(name);
  const auto coefficients = orb_coefficients(camera, /*fisheye=*/false);
  if (is_orb_fisheye(root) || std::ranges::any_of(coefficients, [](double k) { return k != 0.0; })) {
    camera.fail(
        "{} is distorted, but a baseline without a second camera is of rectified images, which have no "
        "distortion; add the right camera, or set k1 ... to 0 if the images are rectified",
        name);
  }
  if (!(baseline_m > 0.0)) camera.fail("the baseline is {:.6g} m, but must be positive", baseline_m);
  const Lens lens = read_orb_lens(root, name);
  OwnCamera own;
  own.rectified = StereoCamera{.fx = lens.fx,
                               .fy = lens.fy,
                               .cx = lens.cx,
                               .cy = lens.cy,
                               .baseline_m = baseline_m,
                               .width_px = lens.width_px,
                               .height_px = lens.height_px};
  return own;
}

/// LEFT.K, LEFT.D, LEFT.R, LEFT.P: what ROS calls camera_info.
[[nodiscard]] CameraInfo read_orb_camera_info(const YamlMap& root, const char* side) {
  const YamlMap map = root.map(side);
  CameraInfo info;
  info.width_px = map.number("width");
  info.height_px = map.number("height");
  if (root.has("distortion_model")) info.distortion_model = root.text({"distortion_model"});
  if (is_orb_fisheye(root)) info.distortion_model = "equidistant";
  info.D = map.numbers({"D"});
  const auto read_into = [&](const char* key, auto& numbers) {
    const auto values = map.matrix(key, numbers.size());
    std::ranges::copy(values, numbers.begin());
  };
  read_into("K", info.K);
  read_into("R", info.R);
  read_into("P", info.P);
  return info;
}

/// How Camera.fx and Camera.bf, which ORB-SLAM tracks with, contradict LEFT.P and RIGHT.P; empty if they do
/// not.
[[nodiscard]] std::string contradiction_of(const YamlMap& root, const CameraInfo& left,
                                           const StereoRig& rig) {
  constexpr double kMostDifference = 0.02;  // relative; files have rounded values
  if (!root.has("Camera")) return {};
  const YamlMap camera = root.map("Camera");
  if (!camera.has("fx")) return {};
  const double fx = camera.number("fx");
  const double P_fx = left.P[0];
  if (std::abs(fx / P_fx - 1.0) > kMostDifference)
    return fmt::format("Camera.fx is {:.6g}, but LEFT.P has {:.6g}, which is used", fx, P_fx);
  if (!camera.has("bf")) return {};
  const double baseline_m = camera.number("bf") / fx;
  const double used_m = rig.T_right_left.translation().norm();
  if (std::abs(baseline_m / used_m - 1.0) <= kMostDifference) return {};
  return fmt::format("Camera.bf gives a baseline of {:.4g} m, but RIGHT.P one of {:.4g} m, which is used",
                     baseline_m, used_m);
}

[[nodiscard]] OwnCamera read_orb_rectification(const YamlMap& root) {
  OwnCamera own;
  try {
    const CameraInfo left = read_orb_camera_info(root, "LEFT");
    const CameraInfo right = read_orb_camera_info(root, "RIGHT");
    own.rig = rig_of(left, right);
    if (const auto warning = baseline_warning(left, right); !warning.empty())
      own.warnings.push_back(fmt::format("{}: {}", root.file().string(), warning));
    if (const auto warning = contradiction_of(root, left, *own.rig); !warning.empty())
      own.warnings.push_back(fmt::format("{}: {}", root.file().string(), warning));
  } catch (const std::invalid_argument& error) {
    fail(root.file(), error.what());
  }
  return own;
}

/// T as a matrix of three or four rows.
[[nodiscard]] Eigen::Isometry3d orb_transform(const YamlMap& map, const char* key) {
  auto values = map.numbers({key});
  if (values.size() != 12) return map.transform(key);
  values.insert(values.end(), {0.0, 0.0, 0.0, 1.0});
  return map.rigid_motion(map.get({key}), key, values);
}

}  // namespace

OwnCamera read_orb_slam(const CalibrationText& text) {
  const YamlMap root(text.file, text.root(), "the file");
  if (text.has("DepthMapFactor") || text.has("RGBD"))
    fail(text.file,
         "is the settings file of ORB-SLAM for a depth camera, but this program needs two cameras");
  if (text.has("LEFT.K")) return read_orb_rectification(root);
  const std::string type = orb_camera_type(root);
  if (type != "PinHole" && type != "KannalaBrandt8" && type != "Rectified")
    fail(text.file, "Camera.type is {}, but must be PinHole, KannalaBrandt8 or Rectified", type);
  if (text.has("Stereo.T_c1_c2"))
    return read_orb_raw(root, "Camera1", orb_transform(root.map("Stereo"), "T_c1_c2"));
  if (text.has("Camera2.fx") && text.has("Tlr"))
    return read_orb_raw(root, "Camera", orb_transform(root, "Tlr"));
  if (text.has("Stereo.b")) return read_orb_rectified(root, "Camera1", root.map("Stereo").number("b"));
  if (text.has("Camera.bf")) {
    const YamlMap camera = root.map("Camera");
    return read_orb_rectified(root, "Camera", camera.number("bf") / camera.number("fx"));
  }
  fail(text.file,
       "is the settings file of ORB-SLAM for one camera; use that of the stereo camera, with Camera.bf, "
       "LEFT.K ... or Stereo.T_c1_c2");
}

}  // namespace stereo_slam
