// SPDX-License-Identifier: MIT
#include "stereo_slam/calibration/rig_file.hpp"

#include <cmath>
#include <initializer_list>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <yaml-cpp/yaml.h>

#include "stereo_slam/calibration/lens_values.hpp"
#include "stereo_slam/calibration/time_shift.hpp"
#include "stereo_slam/calibration/yaml_map.hpp"
#include "stereo_slam/io/counted.hpp"
#include "stereo_slam/io/text_file.hpp"
#include "stereo_slam/settings/yaml_file.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

YamlMap load(const fs::path& file, const std::string& advice) {
  if (!fs::exists(file)) fail(file, "missing; {}", advice);
  return {file, load_yaml_file(file), "the file"};
}

void read_distortion(const YamlMap& map, Lens& lens) {
  const std::string name = map.text({"distortion_model"});
  set_model(lens, name, [&](const std::string& what) { map.fail(map.get({"distortion_model"}), what); });
  if (lens.distortion == Distortion::kNone) return;
  const auto keys = {"distortion_coefficients", "distortion_coeffs"};
  set_coefficients(lens, map.numbers(keys), [&](const std::string& what) { map.fail(map.get(keys), what); });
}

Lens read_lens(const YamlMap& map) {
  if (map.has("camera_model") && map.text({"camera_model"}) != "pinhole") {
    map.fail(map.get({"camera_model"}), "camera_model is {}, but must be pinhole; calibrate with that model",
             map.text({"camera_model"}));
  }
  Lens lens;
  const auto resolution = map.numbers({"resolution"});
  if (resolution.size() != 2)
    map.fail(map.get({"resolution"}), "resolution must be [width, height] in pixels");
  const auto intrinsics = map.numbers({"intrinsics"});
  if (intrinsics.size() != 4) {
    map.fail(map.get({"intrinsics"}), "intrinsics has {}, but must be [fx, fy, cx, cy]",
             counted(intrinsics.size(), "number"));
  }
  set_size(lens, resolution, [&](const std::string& what) { map.fail(map.get({"resolution"}), what); });
  set_pinhole(lens, intrinsics, [&](const std::string& what) { map.fail(map.get({"intrinsics"}), what); });
  read_distortion(map, lens);
  return lens;
}

/// The pose of the camera in the body: EuRoC's T_BS, or Kalibr's T_cam_imu or T_imu_cam. Throws if they
/// differ.
std::optional<Eigen::Isometry3d> read_T_body_camera(const YamlMap& map) {
  std::optional<Eigen::Isometry3d> T_body_camera;
  for (const auto& [key, is_inverse] :
       {std::pair{"T_BS", false}, {"T_imu_cam", false}, {"T_cam_imu", true}}) {
    if (!map.has(key)) continue;
    const Eigen::Isometry3d T = is_inverse ? map.transform(key).inverse() : map.transform(key);
    if (T_body_camera && !agree(*T_body_camera, T)) {
      map.fail(map.get({key}), "{} is not {} {}, the pose of the camera in the body; remove the wrong one",
               key, is_inverse ? "the inverse of" : "equal to", map.has("T_BS") ? "T_BS" : "T_imu_cam");
    }
    if (!T_body_camera) T_body_camera = T;
  }
  return T_body_camera;
}

/// `layout: side-by-side` with the one source of both images.
void read_layout(const YamlMap& map, OwnCamera& own) {
  const bool side_by_side = map.has("layout") && map.text({"layout"}) == "side-by-side";
  if (map.has("layout") && !side_by_side && map.text({"layout"}) != "separate") {
    map.fail(map.get({"layout"}), "layout is {}, but must be side-by-side, or separate (the default)",
             map.text({"layout"}));
  }
  if (side_by_side != map.has("source")) {
    map.fail(
        side_by_side ? map.get({"layout"}) : map.get({"source"}),
        "`layout: side-by-side` and `source: NAME`, of the images that show both cameras, belong together");
  }
  if (side_by_side) own.source = map.text({"source"});
}

/// Reads `source`, the name of a camera's images, if the camera has one. With rectified images, `source` is
/// the only key that a camera may have.
void read_source(const YamlMap& camera, bool rectified, const OwnCamera& own, std::string& source) {
  if (rectified) {
    camera.refuse_unknown_keys({"source"});
  } else {
    camera.refuse_unknown_keys({"source", "camera_model", "resolution", "intrinsics", "distortion_model",
                                "distortion_coefficients"});
  }
  if (!camera.has("source")) return;
  if (own.source) {
    camera.fail(camera.get({"source"}),
                "each camera has a source of its own; leave out `layout: side-by-side`");
  }
  source = camera.text({"source"});
}

/// The camera of images that are rectified already.
StereoCamera read_rectified(const YamlMap& map) {
  const YamlMap camera = map.map("rectified");
  camera.refuse_unknown_keys({"fx", "fy", "cx", "cy", "baseline_m"});
  const StereoCamera rectified{.fx = camera.number("fx"),
                               .fy = camera.number("fy"),
                               .cx = camera.number("cx"),
                               .cy = camera.number("cy"),
                               .baseline_m = camera.number("baseline_m")};
  if (!(rectified.fx > 0.0 && rectified.fy > 0.0)) camera.fail("fx and fy must be positive");
  if (!(rectified.baseline_m > 0.0)) {
    camera.fail(map.get({"rectified"})["baseline_m"], "baseline_m is {}, but must be positive, in metres",
                rectified.baseline_m);
  }
  return rectified;
}

double read_frame_rate(const YamlMap& map) {
  constexpr double kSlowest_hz = 0.01;
  constexpr double kFastest_hz = 1e5;
  const double rate_hz = map.number("frame_rate_hz");
  if (!(rate_hz >= kSlowest_hz && rate_hz <= kFastest_hz)) {
    map.fail(map.get({"frame_rate_hz"}), "frame_rate_hz is {}, but must be from {} to {}", rate_hz,
             kSlowest_hz, kFastest_hz);
  }
  return rate_hz;
}

void set_times(const YamlMap& map, OwnCamera& own) {
  if (map.has("frame_rate_hz")) own.frame_rate_hz = read_frame_rate(map);
  if (map.has("times")) own.times = map.text({"times"});
}

/// From the poses of both cameras in the body, or T_cn_cnm1 of the right camera.
Eigen::Isometry3d read_T_right_left(const std::optional<Eigen::Isometry3d>& T_body_left, const YamlMap& left,
                                    const YamlMap& right) {
  const auto T_body_right = read_T_body_camera(right);
  std::optional<Eigen::Isometry3d> T_right_left;
  if (T_body_left && T_body_right) T_right_left = T_body_right->inverse() * *T_body_left;
  if (right.has("T_cn_cnm1")) {
    const Eigen::Isometry3d T_cn_cnm1 = right.transform("T_cn_cnm1");
    if (T_right_left && !agree(*T_right_left, T_cn_cnm1)) {
      right.fail(right.get({"T_cn_cnm1"}),
                 "T_cn_cnm1 contradicts {} of the two cameras, which give a baseline of {:.4g} m; remove the "
                 "wrong ones",
                 right.has("T_BS")        ? "T_BS"
                 : right.has("T_imu_cam") ? "T_imu_cam"
                                          : "T_cam_imu",
                 T_right_left->translation().norm());
    }
    if (!T_right_left) T_right_left = T_cn_cnm1;
  }
  if (T_right_left) return *T_right_left;
  (T_body_left ? right : left)
      .fail(
          "no T_BS; add the pose of the camera in the body as a 4x4 matrix in metres (or T_cam_imu or "
          "T_imu_cam of both cameras, or T_cn_cnm1 of the right one)");
}

StereoRig read_rig(const YamlMap& left, const YamlMap& right) {
  StereoRig rig{.left = read_lens(left), .right = read_lens(right), .T_right_left = {}, .T_body_left = {}};
  rig.T_body_left = read_T_body_camera(left);
  rig.imu_later_ns = read_time_shift_ns(left);
  rig.T_right_left = read_T_right_left(rig.T_body_left, left, right);
  return rig;
}

}  // namespace

std::string_view to_string(Distortion distortion) noexcept {
  return distortion == Distortion::kRadTan        ? "radtan"
         : distortion == Distortion::kEquidistant ? "equidistant"
                                                  : "none";
}

StereoRig read_sensor_files(const fs::path& left, const fs::path& right) {
  const std::string advice = "copy the calibration of the camera from the recording";
  return read_rig(load(left, advice), load(right, advice));
}

StereoRig read_camchain(const fs::path& file) {
  return read_camchain(file, load(file, "copy the calibration of both cameras from the recording").node());
}

StereoRig read_camchain(const fs::path& file, const YAML::Node& document) {
  const YamlMap map(file, document, "the file");
  return read_rig(map.map("cam0"), map.map("cam1"));
}

OwnCamera read_own_camera(const fs::path& file) {
  const YamlMap map = load(file, "write the calibration as docs/datasets.md describes");
  const std::set<std::string> known = {"left",          "right", "T_right_left", "T_body_left", "rectified",
                                       "frame_rate_hz", "times", "layout",       "source"};
  const bool is_cameras = map.has("rectified") || (map.has("left") && map.has("right"));
  if (const auto first = map.first_key(); !is_cameras && !first.empty() && !known.contains(first)) {
    map.fail(
        "is no calibration of a program that is known (its first key is {}); write its values into a "
        "calibration.yaml as docs/datasets.md describes",
        first);
  }
  map.refuse_unknown_keys(known);
  OwnCamera own;
  read_layout(map, own);
  const bool rectified = map.has("rectified");
  if (rectified && map.has("T_right_left")) {
    map.fail(map.get({"T_right_left"}),
             "T_right_left is of raw images, and `rectified` of rectified ones, which have baseline_m; "
             "remove what is not of these images");
  }
  for (const auto* side : {"left", "right"}) {
    if (map.has(side)) {
      read_source(map.map(side), rectified, own,
                  side == std::string_view("left") ? own.left_source : own.right_source);
    } else if (!rectified) {
      map.fail("there is neither '{}' nor 'rectified'; add the calibration of the camera", side);
    }
  }
  std::optional<Eigen::Isometry3d> T_body_left;
  if (map.has("T_body_left")) T_body_left = map.transform("T_body_left");
  if (rectified) {
    own.rectified = read_rectified(map);
    own.T_body_camera = T_body_left;
  } else {
    own.rig = StereoRig{.left = read_lens(map.map("left")),
                        .right = read_lens(map.map("right")),
                        .T_right_left = map.transform("T_right_left"),
                        .T_body_left = T_body_left};
  }
  set_times(map, own);
  return own;
}

StereoRig rig_for(const OwnCamera& own, const cv::Size& left, const cv::Size& right) {
  StereoRig rig = own.rig.value();
  for (const auto& other : own.other_sizes) {
    if (other.left.width_px == left.width && other.left.height_px == left.height) rig = other;
  }
  for (const auto& [lens, size] : {std::pair{&rig.left, &left}, std::pair{&rig.right, &right}}) {
    if (lens->width_px > 0) continue;
    lens->width_px = size->empty() ? left.width : size->width;
    lens->height_px = size->empty() ? left.height : size->height;
  }
  return rig;
}

void read_times(const fs::path& file, const YAML::Node& document, OwnCamera& own) {
  set_times({file, document, "the file"}, own);
}

}  // namespace stereo_slam
