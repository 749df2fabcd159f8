// SPDX-License-Identifier: MIT
#include "stereo_slam/calibration/calibration_file.hpp"

#include <algorithm>
#include <array>
#include <iterator>
#include <string_view>

#include "stereo_slam/calibration/calibration_formats.hpp"
#include "stereo_slam/io/file_error.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

/// The calibrations of one program.
struct CalibrationFormat {
  std::array<std::string_view, 5> keys;  ///< a file with any of them is one
  OwnCamera (*read)(const CalibrationText&);

  [[nodiscard]] bool recognises(const CalibrationText& text) const {
    return std::ranges::any_of(keys, [&](auto key) { return !key.empty() && text.has(key); });
  }
};

[[nodiscard]] OwnCamera read_kalibr(const CalibrationText& text) {
  OwnCamera own;
  own.rig = read_camchain(text.file, text.root());
  return own;
}

[[noreturn]] OwnCamera refuse_one_camera(const CalibrationText& text) {
  fail(text.file,
       "is the calibration of one camera; calibrate the two cameras as a stereo pair, which gives the "
       "matrices of both and their relative pose");
}

/// The first one that recognises a file reads it.
constexpr CalibrationFormat kFormats[] = {
    {{"projection_matrix", "P", "p"}, read_ros},
    {{"cam0"}, read_kalibr},
    {{"M1", "K1", "cameraMatrix1", "camera_matrix_1", "cameraMatrixL"}, read_opencv_stereo},
    {{"stereo.baseline"}, read_zed},
    {{"Camera.focal_x_baseline", "StereoRectifier", "Camera.setup"}, read_stella},
    {{"Camera.fx", "Camera1.fx", "LEFT.K"}, read_orb_slam},
    {{"cam0_calib"}, read_vins},
    {{"model_type"}, read_camodocal_camera},
    {{"relative_config_imucam"}, read_open_vins},
    {{"value0.intrinsics"}, read_basalt},
    {{"camera_matrix", "cameraMatrix", "Camera_Matrix", "intrinsics"}, refuse_one_camera},
};

}  // namespace

OwnCamera read_calibration(const fs::path& path) {
  if (fs::is_directory(path)) {
    if (!fs::exists(path / "left.yaml"))
      fail(path, "is a folder without left.yaml; name the calibration in it");
    return read_calibration(path / "left.yaml");
  }
  if (!fs::exists(path)) fail(path, "missing; it has to be the calibration of the camera");
  const CalibrationText text = load_calibration_text(path);
  const auto* format = std::find_if(std::begin(kFormats), std::end(kFormats),
                                    [&](const auto& known) { return known.recognises(text); });
  if (format == std::end(kFormats)) return read_own_camera(path);
  if (text.documents.size() > 1 && format->read != read_ros)
    fail(path, "holds several documents; keep the one of this camera, without the line `---`");
  OwnCamera own = format->read(text);
  for (const auto& document : text.documents) read_times(path, document, own);
  return own;
}

}  // namespace stereo_slam
