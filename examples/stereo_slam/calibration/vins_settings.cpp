// SPDX-License-Identifier: MIT
#include <string>
#include <system_error>

#include "stereo_slam/calibration/calibration_formats.hpp"
#include "stereo_slam/calibration/lens_values.hpp"
#include "stereo_slam/calibration/yaml_map.hpp"
#include "stereo_slam/io/file_error.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

/// A file that another one names by a path relative to itself.
[[nodiscard]] CalibrationText named_file(const YamlMap& root, const char* key) {
  const fs::path file = root.file().parent_path() / root.text({key});
  std::error_code unusable;  // a name that is too long, say
  if (!fs::is_regular_file(file, unusable))
    fail(file, "missing; {} names it as {}", root.file().string(), key);
  return load_calibration_text(file);
}

/// A camera file of camodocal, which VINS uses.
[[nodiscard]] Lens read_camodocal(const CalibrationText& text) {
  const YamlMap root(text.file, text.root(), "the file");
  const std::string model = root.text({"model_type"});
  if (model != "PINHOLE" && model != "KANNALA_BRANDT") {
    root.fail(root.get({"model_type"}),
              "model_type is {}, but must be PINHOLE or KANNALA_BRANDT; calibrate with one of them", model);
  }
  const bool fisheye = model == "KANNALA_BRANDT";
  const YamlMap projection = root.map("projection_parameters");
  const YamlMap distortion = fisheye ? projection : root.map("distortion_parameters");
  const Fail fail_here = [&](const std::string& what) { root.fail(what); };
  const auto numbers = [](const YamlMap& map, std::initializer_list<const char*> keys) {
    std::vector<double> values;
    for (const char* key : keys) values.push_back(map.number(key));
    return values;
  };
  Lens lens;
  set_size(lens, numbers(root, {"image_width", "image_height"}), fail_here);
  const auto pinhole =
      fisheye ? numbers(projection, {"mu", "mv", "u0", "v0"}) : numbers(projection, {"fx", "fy", "cx", "cy"});
  set_pinhole(lens, pinhole, fail_here);
  set_model(lens, fisheye ? "equidistant" : "radtan", fail_here);
  const auto coefficients =
      fisheye ? numbers(distortion, {"k2", "k3", "k4", "k5"}) : numbers(distortion, {"k1", "k2", "p1", "p2"});
  set_coefficients(lens, coefficients, fail_here);
  return lens;
}

}  // namespace

OwnCamera read_vins(const CalibrationText& text) {
  const YamlMap root(text.file, text.root(), "the file");
  if (!text.has("cam1_calib")) {
    fail(text.file, "is the settings file of VINS for one camera; use one with cam0_calib and cam1_calib");
  }
  StereoRig rig;
  rig.left = read_camodocal(named_file(root, "cam0_calib"));
  rig.right = read_camodocal(named_file(root, "cam1_calib"));
  rig.T_body_left = root.transform("body_T_cam0");
  rig.T_right_left = root.transform("body_T_cam1").inverse() * *rig.T_body_left;
  OwnCamera own;
  own.rig = rig;
  return own;
}

OwnCamera read_camodocal_camera(const CalibrationText& text) {
  fail(text.file,
       "is one camera of VINS; name the settings file of the stereo camera, which has cam0_calib, "
       "cam1_calib, body_T_cam0 and body_T_cam1");
}

OwnCamera read_open_vins(const CalibrationText& text) {
  const YamlMap root(text.file, text.root(), "the file");
  const CalibrationText cameras = named_file(root, "relative_config_imucam");
  OwnCamera own;
  own.rig = read_camchain(cameras.file, cameras.root());
  return own;
}

}  // namespace stereo_slam
