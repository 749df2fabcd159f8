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

/// The formats of other programs. The first one that recognises a file reads it.
constexpr CalibrationFormat kFormats[] = {
    {has_camera_info, read_ros},
    {[](const CalibrationText& text) { return text.has("cam0"); }, read_kalibr},
    {[](const CalibrationText& text) {
       return has_any(text, {"M1", "K1", "cameraMatrix1", "camera_matrix_1", "cameraMatrixL"});
     },
     read_opencv_stereo},
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
