// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/calibration_file.hpp"

#include <algorithm>
#include <iterator>

#include "stereo_slam/dataset/calibration_formats.hpp"
#include "stereo_slam/io/file_error.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

struct CalibrationFormat {
  bool (*recognises)(const CalibrationText&);
  OwnCamera (*read)(const CalibrationText&);
};

[[nodiscard]] bool has_camera_info(const CalibrationText& text) {
  const auto& first = text.root();
  if (!first.IsMap()) return false;
  const auto has = [&](const char* key) { return first[key].IsDefined(); };
  return (has("image_width") && has("projection_matrix")) ||
         (has("width") && ((has("K") && has("P")) || (has("k") && has("p"))));
}

[[nodiscard]] bool has_any(const CalibrationText& text, std::initializer_list<const char*> keys) {
  return std::any_of(keys.begin(), keys.end(), [&](const char* key) { return text.has(key); });
}

[[nodiscard]] OwnCamera read_kalibr(const CalibrationText& text) {
  OwnCamera own;
  own.rig = read_camchain(text.file, text.root());
  return own;
}

[[noreturn]] OwnCamera refuse_one_camera(const CalibrationText& text) {
  fail(text.file,
       "is the calibration of one camera; calibrate the two cameras as a stereo pair, which gives the "
       "matrices of both "
       "and their relative pose");
}

/// The formats of other programs. The first one that recognises a file reads it.
constexpr CalibrationFormat kFormats[] = {
    {has_camera_info, read_ros},
    {[](const auto& text) { return text.has("cam0"); }, read_kalibr},
    {[](const auto& text) {
       return has_any(text, {"M1", "K1", "cameraMatrix1", "camera_matrix_1", "cameraMatrixL"});
     },
     read_opencv_stereo},
    {[](const auto& text) { return text.has("stereo.baseline"); }, read_zed},
    {[](const auto& text) {
       return has_any(text, {"Camera.focal_x_baseline", "StereoRectifier", "Camera.setup"});
     },
     read_stella},
    {[](const auto& text) {
       return has_any(text, {"Camera.fx", "Camera1.fx", "LEFT.K"});
     },
     read_orb_slam},
    {[](const auto& text) { return text.has("cam0_calib"); }, read_vins},
    {[](const auto& text) { return text.has("model_type"); }, read_camodocal_camera},
    {[](const auto& text) { return text.has("relative_config_imucam"); }, read_open_vins},
    {[](const auto& text) { return text.has("value0.intrinsics"); }, read_basalt},
    {[](const auto& text) {
       return has_any(text, {"camera_matrix", "cameraMatrix", "Camera_Matrix", "intrinsics"});
     },
     refuse_one_camera},
};

}  // namespace

OwnCamera read_calibration(const fs::path& path) {
  if (fs::is_directory(path)) return read_calibration(path / "left.yaml");
  if (!fs::exists(path)) fail(path, "missing; it has to be the calibration of the camera");
  const CalibrationText text = load_calibration_text(path);
  const auto* format = std::find_if(std::begin(kFormats), std::end(kFormats),
                                    [&](const auto& known) { return known.recognises(text); });
  if (format == std::end(kFormats)) return read_own_camera(path);
  OwnCamera own = format->read(text);
  for (const auto& document : text.documents) read_times(path, document, own);
  return own;
}

}  // namespace stereo_slam
