// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/calibration_file.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "stereo_slam/dataset/lens_values.hpp"
#include "stereo_slam/dataset/opencv_xml.hpp"
#include "stereo_slam/dataset/yaml_map.hpp"
#include "stereo_slam/io/file_error.hpp"
#include "stereo_slam/settings/yaml_file.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;
using RowMajor3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

/// R, made exactly orthonormal, as files hold rounded numbers. Throws std::runtime_error if R is no rotation.
Eigen::Matrix3d rotation_of(const RowMajor3& R, const fs::path& file, std::string_view name) {
  constexpr double kTolerance = 1e-2;
  const double error = (R * R.transpose() - RowMajor3::Identity()).cwiseAbs().maxCoeff();
  if (!(error < kTolerance && R.determinant() > 0.0)) fail(file, fmt::format("{} is not a rotation", name));
  return Eigen::Quaterniond(Eigen::Matrix3d(R)).normalized().toRotationMatrix();
}

/// A file of OpenCV's FileStorage. It is not read by OpenCV, whose parsers crash or do not end for some
/// damaged files.
class OpenCvFile {
 public:
  explicit OpenCvFile(const fs::path& file)
      : file_(file), root_(file.extension() == ".xml" ? load_opencv_xml(file) : load_yaml_file(file)) {
    if (!root_.IsMap()) fail(file, "is no file of named values; write it by cv::FileStorage");
  }

  /// The name of the first key that is there; empty if none is.
  [[nodiscard]] std::string find(std::initializer_list<const char*> keys) const {
    for (const char* key : keys) {
      if (root_[key].IsDefined() && !root_[key].IsNull()) return key;
    }
    return "";
  }

  /// The numbers of a matrix, row by row, or of a list; at least `least` and at most `most`.
  [[nodiscard]] std::vector<double> numbers(std::initializer_list<const char*> keys, std::size_t least,
                                            std::size_t most) const {
    const std::string key = find(keys);
    if (key.empty())
      fail(file_, fmt::format("has no {}; write it by cv::FileStorage", fmt::join(keys, " or ")));
    const YAML::Node node = root_[key];
    std::vector<double> values;
    append(node.IsMap() ? node["data"] : node, most, values);
    const bool finite = std::all_of(values.begin(), values.end(), [](double x) { return std::isfinite(x); });
    if (values.size() < least || values.size() > most || !finite)
      fail(file_, fmt::format("{} is not a matrix or a list of {} finite numbers", key, least));
    return values;
  }

  [[nodiscard]] std::string text(const char* key) const {
    const YAML::Node node = root_[key];
    return node.IsDefined() && node.IsScalar() ? node.Scalar() : std::string();
  }

  [[nodiscard]] const fs::path& path() const { return file_; }

 private:
  static void append(const YAML::Node& node, std::size_t most, std::vector<double>& values) {
    if (!node.IsDefined()) return;
    if (node.IsScalar()) values.push_back(node.as<double>(std::numeric_limits<double>::quiet_NaN()));
    if (!node.IsSequence()) return;
    for (const auto& part : node) {
      if (values.size() > most) return;
      append(part, most, values);
    }
  }

  fs::path file_;
  YAML::Node root_;
};

void read_opencv_size(const OpenCvFile& file, Lens& lens) {
  const Fail fail_here = [&](const std::string& what) { fail(file.path(), what); };
  if (!file.find({"image_size", "imageSize", "size"}).empty()) {
    set_size(lens, file.numbers({"image_size", "imageSize", "size"}, 2, 2), fail_here);
  } else if (!file.find({"image_width"}).empty()) {
    set_size(lens, {file.numbers({"image_width"}, 1, 1)[0], file.numbers({"image_height"}, 1, 1)[0]},
             fail_here);
  }
}

struct LensKeys {
  std::initializer_list<const char*> matrix;
  std::initializer_list<const char*> coefficients;
};

Lens read_opencv_lens(const OpenCvFile& file, const LensKeys& keys) {
  const Fail fail_here = [&](const std::string& what) { fail(file.path(), what); };
  constexpr std::size_t kMostCoefficients = 14;
  Lens lens;
  read_opencv_size(file, lens);
  const auto K = file.numbers(keys.matrix, 9, 9);
  set_pinhole(lens, {K[0], K[4], K[2], K[5]}, fail_here);
  const std::string model = file.text("distortion_model");
  set_model(lens, model.empty() ? "radtan" : model, fail_here);
  if (lens.distortion != Distortion::kNone)
    set_coefficients(lens, file.numbers(keys.coefficients, 4, kMostCoefficients), fail_here);
  return lens;
}

/// The file itself if it contains R and T, else extrinsics.yml beside it, as OpenCV's sample names it.
OpenCvFile extrinsics_of(const OpenCvFile& file) {
  if (!file.find({"T"}).empty()) return OpenCvFile(file.path());
  for (const char* name : {"extrinsics.yml", "extrinsics.yaml", "extrinsics.xml"}) {
    if (fs::exists(file.path().parent_path() / name)) return OpenCvFile(file.path().parent_path() / name);
  }
  fail(file.path(), "has no T; add R and T of cv::stereoCalibrate, or extrinsics.yml beside it");
}

OwnCamera read_opencv_stereo(const fs::path& path) {
  const OpenCvFile file(path);
  StereoRig rig;
  rig.left = read_opencv_lens(file, {{"M1", "K1", "cameraMatrix1", "camera_matrix_1"},
                                     {"D1", "distCoeffs1", "distortion_coefficients_1"}});
  rig.right = read_opencv_lens(file, {{"M2", "K2", "cameraMatrix2", "camera_matrix_2"},
                                      {"D2", "distCoeffs2", "distortion_coefficients_2"}});
  const OpenCvFile extrinsics = extrinsics_of(file);
  const auto R = extrinsics.numbers({"R"}, 9, 9);
  const auto T = extrinsics.numbers({"T"}, 3, 3);
  rig.T_right_left.linear() = rotation_of(Eigen::Map<const RowMajor3>(R.data()), extrinsics.path(), "R");
  rig.T_right_left.translation() = Eigen::Map<const Eigen::Vector3d>(T.data());
  OwnCamera own;
  own.rig = rig;
  return own;
}

/// The elements of the matrix `key`, which ROS writes as {rows, cols, data}; `count` 0 accepts any number.
std::vector<double> ros_numbers(const YamlMap& map, const char* key, std::size_t count) {
  auto values = map.map(key).numbers({"data"});
  if (count > 0 && values.size() != count)
    map.fail(map.get({key}), fmt::format("{} has {} numbers, but needs {}", key, values.size(), count));
  return values;
}

CameraInfo read_camera_info(const fs::path& file) {
  const YamlMap map(file, load_yaml_file(file), "the file");
  const Fail fail_here = [&](const std::string& what) { map.fail(what); };
  CameraInfo info;
  set_size(info.lens, {map.number("image_width"), map.number("image_height")}, fail_here);
  const auto K = ros_numbers(map, "camera_matrix", 9);
  set_pinhole(info.lens, {K[0], K[4], K[2], K[5]}, fail_here);
  set_model(info.lens, map.text({"distortion_model"}), fail_here);
  if (info.lens.distortion != Distortion::kNone)
    set_coefficients(info.lens, ros_numbers(map, "distortion_coefficients", 0), fail_here);
  const auto R = ros_numbers(map, "rectification_matrix", 9);
  info.R = rotation_of(Eigen::Map<const RowMajor3>(R.data()), file, "rectification_matrix");
  const auto P = ros_numbers(map, "projection_matrix", 12);
  info.P = Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(P.data());
  return info;
}

/// The file of the right camera beside that of the left one.
fs::path right_of(const fs::path& left) {
  std::string name = left.filename().string();
  const auto at = name.find("left");
  if (at == std::string::npos) {
    fail(left,
         "is one camera of a ROS pair; call the two files left.yaml and right.yaml, and name the left one");
  }
  fs::path right = left.parent_path() / name.replace(at, std::string_view("left").size(), "right");
  if (!fs::exists(right)) fail(right, "missing; it has to be beside the camera_info of the left camera");
  return right;
}

OwnCamera read_ros_pair(const fs::path& left) {
  const fs::path right = right_of(left);
  OwnCamera own;
  try {
    own.rig = rig_of(read_camera_info(left), read_camera_info(right));
  } catch (const std::invalid_argument& error) {
    fail(right, error.what());
  }
  return own;
}

/// A YAML file of Kalibr, ROS or OpenCV; nothing if it is of none of them.
[[nodiscard]] std::optional<OwnCamera> read_other_format(const fs::path& file) {
  const YAML::Node document = load_yaml_file(file);
  const auto has = [&](const char* key) { return document.IsMap() && document[key].IsDefined(); };
  if (has("cam0")) {
    OwnCamera own;
    own.rig = read_camchain(file);
    return own;
  }
  if (has("image_width") && has("projection_matrix")) return read_ros_pair(file);
  const auto opencv_keys = {"M1", "K1", "cameraMatrix1", "camera_matrix_1"};
  if (std::any_of(opencv_keys.begin(), opencv_keys.end(), has)) return read_opencv_stereo(file);
  return std::nullopt;
}

}  // namespace

StereoRig rig_of(const CameraInfo& left, const CameraInfo& right) {
  if (right.P(0, 3) == 0.0 && left.P(0, 3) != 0.0) {
    throw std::invalid_argument(
        "the baseline is in the projection matrix of the left camera, not in that of the right one; the two "
        "are swapped: name them the other way round");
  }
  if (!(right.P(0, 0) > 0.0) || right.P(0, 3) == 0.0) {
    throw std::invalid_argument(
        "the projection matrix has no baseline, P[3] = -fx * baseline; calibrate the two cameras as a stereo "
        "pair");
  }
  // Both rectified cameras have the same axes; the right one lies at -P[3] / fx on the left one's x axis.
  const Eigen::Translation3d T_right_left_rectified(right.P(0, 3) / right.P(0, 0), 0.0, 0.0);
  StereoRig rig;
  rig.left = left.lens;
  rig.right = right.lens;
  rig.T_right_left = Eigen::Isometry3d(Eigen::Quaterniond(right.R).conjugate()) * T_right_left_rectified *
                     Eigen::Quaterniond(left.R);
  return rig;
}

OwnCamera read_calibration(const fs::path& path) {
  if (fs::is_directory(path)) return read_calibration(path / "left.yaml");
  if (!fs::exists(path)) fail(path, "missing; it has to be the calibration of the camera");
  if (path.extension() == ".xml") return read_opencv_stereo(path);
  auto own = read_other_format(path);
  if (!own) return read_own_camera(path);
  read_times(path, *own);
  return *own;
}

}  // namespace stereo_slam
