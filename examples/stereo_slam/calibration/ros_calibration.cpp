// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "stereo_slam/calibration/calibration_formats.hpp"
#include "stereo_slam/calibration/camera_info.hpp"
#include "stereo_slam/calibration/yaml_map.hpp"
#include "stereo_slam/io/file_error.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

/// The keys of a CameraInfo in one of the ways in which ROS writes it.
struct CameraInfoKeys {
  const char* width;
  const char* height;
  const char* K;
  const char* D;
  const char* R;
  const char* P;
};
constexpr CameraInfoKeys kCameraInfoKeys[] = {
    {"image_width", "image_height", "camera_matrix", "distortion_coefficients", "rectification_matrix",
     "projection_matrix"},                    // camera_calibration
    {"width", "height", "K", "D", "R", "P"},  // rostopic echo
    {"width", "height", "k", "d", "r", "p"}   // ros2 topic echo
};

template <std::size_t kCount>
void read_numbers(const YamlMap& map, const char* key, std::array<double, kCount>& numbers) {
  const auto values = map.matrix(key, kCount);
  std::ranges::copy(values, numbers.begin());
}

/// Whether a list has no value, as `D:` or `data: null`; some writers mean an empty one.
[[nodiscard]] bool is_null(const YAML::Node& list) {
  return list.IsNull() || (list.IsMap() && list["data"] && list["data"].IsNull());
}

/// One camera of a file, and its name there.
struct NamedCameraInfo {
  std::string name;
  CameraInfo info;
};

[[nodiscard]] NamedCameraInfo read_camera_info(const fs::path& file, const YAML::Node& document) {
  const YamlMap map(file, document, "the file");
  const auto* keys = std::find_if(std::begin(kCameraInfoKeys), std::end(kCameraInfoKeys),
                                  [&](const CameraInfoKeys& known) { return map.has(known.P); });
  if (keys == std::end(kCameraInfoKeys)) keys = std::begin(kCameraInfoKeys);
  NamedCameraInfo camera;
  auto& info = camera.info;
  info.width_px = map.number(keys->width);
  info.height_px = map.number(keys->height);
  read_numbers(map, keys->K, info.K);
  if (map.has("distortion_model") && !map.get({"distortion_model"}).Scalar().empty())
    info.distortion_model = map.text({"distortion_model"});
  if (map.has(keys->D) && !is_null(map.get({keys->D}))) info.D = map.numbers({keys->D});
  read_numbers(map, keys->R, info.R);
  read_numbers(map, keys->P, info.P);
  if (is_calibrated(info))
    (void)pinhole_of(info, [&](const std::string& what) { map.fail(map.get({keys->K}), what); });
  if (map.has("camera_name")) camera.name = map.get({"camera_name"}).Scalar();
  if (map.has("header") && map.map("header").has("frame_id"))
    camera.name = map.map("header").get({"frame_id"}).Scalar();
  return camera;
}

/// Whether it is what a user added after the last message.
[[nodiscard]] bool only_has_times(const YAML::Node& document) {
  return document.IsMap() && std::all_of(document.begin(), document.end(), [](const auto& entry) {
           const auto key = entry.first.Scalar();
           return key == "frame_rate_hz" || key == "times";
         });
}

/// The cameras of a file. The second and later messages of the same camera are left out, and those of cameras
/// that are not calibrated yet. Throws std::runtime_error if there is no other.
[[nodiscard]] std::vector<NamedCameraInfo> read_camera_infos(const CalibrationText& text) {
  std::vector<NamedCameraInfo> cameras;
  for (const auto& document : text.documents) {
    if (only_has_times(document)) continue;
    auto camera = read_camera_info(text.file, document);
    const auto same = [&](const NamedCameraInfo& other) {
      return other.info.K == camera.info.K && other.info.P == camera.info.P;
    };
    if (is_calibrated(camera.info) && std::ranges::none_of(cameras, same))
      cameras.push_back(std::move(camera));
  }
  if (cameras.empty()) {
    fail(text.file,
         "the camera matrix K is zero, which says that the camera is not calibrated; calibrate the two "
         "cameras as a stereo pair");
  }
  return cameras;
}

/// How a left and a right camera are told apart in names.
constexpr std::pair<std::string_view, std::string_view> kSides[] = {
    {"left", "right"}, {"Left", "Right"}, {"LEFT", "RIGHT"}, {"cam0", "cam1"}, {"infra1", "infra2"}};

/// The name with `left` replaced by `right`; empty if it is not that of a left camera.
[[nodiscard]] std::string right_name_of(const std::string& name) {
  for (const auto& [left, right] : kSides) {
    if (const auto at = name.find(left); at != std::string::npos)
      return std::string(name).replace(at, left.size(), right);
  }
  return "";
}

/// Puts the left one of two cameras of one file first: by their names, else by P[3], which is larger for the
/// left one.
void sort_cameras(std::vector<NamedCameraInfo>& cameras) {
  const auto& [first, second] = std::pair(cameras[0], cameras[1]);
  const bool named = right_name_of(first.name) == second.name;
  const bool named_reversed = right_name_of(second.name) == first.name;
  const bool reversed = named != named_reversed && !first.name.empty() && !second.name.empty()
                            ? named_reversed
                            : first.info.P[3] < second.info.P[3];
  if (reversed) std::swap(cameras[0], cameras[1]);
}

/// The file of the right camera beside that of the left one.
[[nodiscard]] fs::path right_of(const fs::path& left) {
  const std::string name = right_name_of(left.filename().string());
  if (name.empty()) {
    fail(left,
         "is one camera of a ROS pair; call the two files left.yaml and right.yaml, and name the left one");
  }
  fs::path right = left.parent_path() / name;
  if (!fs::exists(right)) fail(right, "missing; it has to be beside the camera_info of the left camera");
  return right;
}

}  // namespace

OwnCamera read_ros(const CalibrationText& text) {
  auto cameras = read_camera_infos(text);
  fs::path of_right = text.file;
  if (cameras.size() == 1) {
    of_right = right_of(text.file);
    const auto right = read_camera_infos(load_calibration_text(of_right));
    cameras.push_back(right.front());
  } else if (cameras.size() == 2) {
    sort_cameras(cameras);
  }
  if (cameras.size() != 2)
    fail(text.file, "holds the camera_info of {} cameras; keep those of the left and the right one",
         cameras.size());
  const auto& left = cameras[0].info;
  const auto& right = cameras[1].info;
  OwnCamera own;
  try {
    own.rig = rig_of(left, right);
  } catch (const std::invalid_argument& error) {
    fail(of_right, error.what());
  }
  if (const auto warning = baseline_warning(left, right); !warning.empty())
    own.warnings.push_back(fmt::format("{}: {}", of_right.string(), warning));
  return own;
}

}  // namespace stereo_slam
