// SPDX-License-Identifier: MIT
#include <algorithm>
#include <stdexcept>
#include <string>

#include "stereo_slam/calibration/calibration_formats.hpp"
#include "stereo_slam/calibration/camera_info.hpp"
#include "stereo_slam/calibration/yaml_map.hpp"
#include "stereo_slam/io/file_error.hpp"

namespace stereo_slam {
namespace {

/// One raw camera of StereoRectifier. Both rectified cameras are `Camera`; P[3] is that of this one.
[[nodiscard]] CameraInfo read_stella_camera_info(const YamlMap& root, const std::string& side, double P3) {
  const YamlMap camera = root.map("Camera");
  const YamlMap rectifier = root.map("StereoRectifier");
  const std::string model = rectifier.has("model") ? rectifier.text({"model"}) : "perspective";
  if (model != "perspective" && model != "fisheye")
    rectifier.fail("StereoRectifier.model is {}, but must be perspective or fisheye", model);
  CameraInfo info;
  info.width_px = camera.number("cols");
  info.height_px = camera.number("rows");
  info.distortion_model = model == "fisheye" ? "equidistant" : "radtan";
  info.D = rectifier.numbers({("D_" + side).c_str()});
  const auto K = rectifier.matrix(("K_" + side).c_str(), info.K.size());
  const auto R = rectifier.matrix(("R_" + side).c_str(), info.R.size());
  std::ranges::copy(K, info.K.begin());
  std::ranges::copy(R, info.R.begin());
  info.P = {camera.number("fx"),
            0.0,
            camera.number("cx"),
            P3,  //
            0.0,
            camera.number("fy"),
            camera.number("cy"),
            0.0,
            0.0,
            0.0,
            1.0,
            0.0};
  return info;
}

/// Images that are rectified already.
[[nodiscard]] OwnCamera read_stella_rectified(const YamlMap& root, double focal_x_baseline) {
  const YamlMap camera = root.map("Camera");
  for (const char* key : {"k1", "k2", "k3", "k4", "p1", "p2"}) {
    if (camera.number_or(key, 0.0) == 0.0) continue;
    camera.fail(
        "Camera.{} is not 0, but without StereoRectifier the images are rectified and have no distortion; "
        "add StereoRectifier, or set it to 0 if the images are rectified",
        key);
  }
  Lens lens;
  const Fail fail_camera = [&](const std::string& what) { camera.fail(what); };
  if (camera.has("cols")) set_size(lens, {camera.number("cols"), camera.number("rows")}, fail_camera);
  set_pinhole(lens, {camera.number("fx"), camera.number("fy"), camera.number("cx"), camera.number("cy")},
              fail_camera);
  OwnCamera own;
  own.rectified = StereoCamera{.fx = lens.fx,
                               .fy = lens.fy,
                               .cx = lens.cx,
                               .cy = lens.cy,
                               .baseline_m = focal_x_baseline / lens.fx,
                               .width_px = lens.width_px,
                               .height_px = lens.height_px};
  return own;
}

}  // namespace

OwnCamera read_stella(const CalibrationText& text) {
  const YamlMap root(text.file, text.root(), "the file");
  if (!text.has("Camera.focal_x_baseline")) {
    fail(text.file,
         "is the settings file of stella_vslam for one camera; use that of the stereo camera, which has "
         "Camera.focal_x_baseline");
  }
  const double focal_x_baseline = root.map("Camera").number("focal_x_baseline");
  if (!(focal_x_baseline > 0.0))
    fail(text.file, "Camera.focal_x_baseline is {:.6g}, but must be positive", focal_x_baseline);
  if (!text.has("StereoRectifier")) return read_stella_rectified(root, focal_x_baseline);
  OwnCamera own;
  try {
    own.rig = rig_of(read_stella_camera_info(root, "left", 0.0),
                     read_stella_camera_info(root, "right", -focal_x_baseline));
  } catch (const std::invalid_argument& error) {
    fail(text.file, error.what());
  }
  return own;
}

}  // namespace stereo_slam
