// SPDX-License-Identifier: MIT
#include <array>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "stereo_slam/calibration/calibration_formats.hpp"
#include "stereo_slam/calibration/given_distortion.hpp"
#include "stereo_slam/calibration/yaml_map.hpp"
#include "stereo_slam/io/file_error.hpp"

namespace stereo_slam {
namespace {

/// A resolution of ZED cameras, as it is called in the names of sections and keys.
struct ZedSize {
  const char* name;
  double width_px;
  double height_px;
};
constexpr std::array<ZedSize, 8> kZedSizes = {{{"hd", 1280, 720},
                                               {"fhd", 1920, 1080},
                                               {"fhd1200", 1920, 1200},
                                               {"2k", 2208, 1242},
                                               {"svga", 960, 600},
                                               {"vga", 672, 376},
                                               {"4k", 3840, 2160},
                                               {"qhdplus", 3200, 1800}}};

/// The value `key` of one resolution, else that of all.
[[nodiscard]] std::optional<double> stereo_value(const YamlMap& stereo, const std::string& key,
                                                 const ZedSize& size) {
  for (const std::string& name : {key + "_" + size.name, key}) {
    if (stereo.has(name)) return stereo.number(name.c_str());
  }
  return std::nullopt;
}

/// The coefficients of a side: [LEFT_DISTO] holds those of all resolutions, in newer files.
[[nodiscard]] GivenDistortion zed_distortion(const YamlMap& root, const std::string& side,
                                             const YamlMap& camera) {
  const bool common = root.has(side + "_disto");
  const YamlMap map = common ? root.map(side + "_disto") : camera;
  const auto k = [&](const char* key) { return map.number_or(key, 0.0); };
  if (!common) return {"radtan", {k("k1"), k("k2"), k("p1"), k("p2"), k("k3")}};
  if (k("k4") != 0.0 && k("p1") == 0.0 && k("p2") == 0.0 && k("k5") == 0.0 && k("k6") == 0.0)
    return {"equidistant", {k("k1"), k("k2"), k("k3"), k("k4")}};
  return {"radtan", {k("k1"), k("k2"), k("p1"), k("p2"), k("k3"), k("k4"), k("k5"), k("k6")}};
}

[[nodiscard]] Lens zed_pinhole(const YamlMap& camera, const ZedSize& size) {
  const Fail fail_camera = [&](const std::string& what) { camera.fail(what); };
  Lens lens;
  set_size(lens, {size.width_px, size.height_px}, fail_camera);
  set_pinhole(lens, {camera.number("fx"), camera.number("fy"), camera.number("cx"), camera.number("cy")},
              fail_camera);
  return lens;
}

/// T of Stereolabs' calibration program: (-Baseline, TY, TZ) mm, and the rotation vector (RX, CV, RZ).
/// Nothing if the file does not have them for this resolution.
[[nodiscard]] std::optional<Eigen::Isometry3d> zed_T_right_left(const YamlMap& stereo, const ZedSize& size) {
  constexpr double kMillimetre_m = 1e-3;
  const auto rx = stereo_value(stereo, "rx", size);
  const auto ry = stereo_value(stereo, "cv", size);
  const auto rz = stereo_value(stereo, "rz", size);
  if (!rx || !ry || !rz) return std::nullopt;
  const Eigen::Vector3d rotation(*rx, *ry, *rz);
  const Eigen::Vector3d t_mm(-stereo.number("baseline"), stereo_value(stereo, "ty", size).value_or(0.0),
                             stereo_value(stereo, "tz", size).value_or(0.0));
  return Eigen::Translation3d(kMillimetre_m * t_mm) *
         Eigen::AngleAxisd(rotation.norm(), rotation.stableNormalized());
}

}  // namespace

OwnCamera read_zed(const CalibrationText& text) {
  constexpr double kShortest_mm = 1.0;
  const YamlMap root(text.file, text.root(), "the file");
  const YamlMap stereo = root.map("stereo");
  if (!(stereo.number("baseline") > kShortest_mm)) {
    fail(text.file, "the Baseline of [STEREO] is {}, but must be positive, in millimetres",
         stereo.number("baseline"));
  }
  std::vector<StereoRig> rigs;
  for (const auto& size : kZedSizes) {
    const std::string left = fmt::format("left_cam_{}", size.name);
    const std::string right = fmt::format("right_cam_{}", size.name);
    if (!root.has(left) || !root.has(right)) continue;
    const auto T_right_left = zed_T_right_left(stereo, size);
    if (!T_right_left) continue;
    StereoRig rig;
    rig.left = zed_pinhole(root.map(left), size);
    rig.right = zed_pinhole(root.map(right), size);
    set_distortions(rig, zed_distortion(root, "left", root.map(left)),
                    zed_distortion(root, "right", root.map(right)),
                    [&](const std::string& what) { fail(text.file, what); });
    rig.T_right_left = *T_right_left;
    rigs.push_back(std::move(rig));
  }
  if (rigs.empty()) {
    fail(text.file,
         "has no resolution with [LEFT_CAM_...], [RIGHT_CAM_...] and RX_..., CV_..., RZ_... of [STEREO]; "
         "download the file of this camera's serial number from Stereolabs");
  }
  OwnCamera own;
  own.rig = rigs.front();
  own.other_sizes.assign(rigs.begin() + 1, rigs.end());
  return own;
}

}  // namespace stereo_slam
