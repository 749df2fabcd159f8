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

  /// The name of a key beside `key` that is there; empty if none is.
  [[nodiscard]] std::string find_another(std::string_view key,
                                         std::initializer_list<const char*> keys) const {
    for (const char* other : keys) {
      if (other != key && !find({other}).empty()) return other;
    }
    return "";
  }

  /// The numbers of a matrix, row by row, or of a list; at least `least` and at most `most`.
  [[nodiscard]] std::vector<double> numbers(std::initializer_list<const char*> keys, std::size_t least,
                                            std::size_t most) const {
    const std::string key = find(keys);
    if (key.empty())
      fail(file_, fmt::format("has no {}; write it by cv::FileStorage", fmt::join(keys, " or ")));
    const std::string other = find_another(key, keys);
    if (!other.empty())
      fail(file_, fmt::format("has both {} and {}, which are the same; remove one", key, other));
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
  set_camera_matrix(lens, file.numbers(keys.matrix, 9, 9),
                    [&](const std::string& what) { fail_here(file.find(keys.matrix) + ": " + what); });
  const std::string model = file.text("distortion_model");
  set_model(lens, model.empty() ? "radtan" : model, fail_here);
  if (lens.distortion != Distortion::kNone)
    set_coefficients(lens, file.numbers(keys.coefficients, 4, kMostCoefficients), fail_here);
  return lens;
}

/// The file extrinsics.yml beside another, as OpenCV's sample names it; empty if there is none.
fs::path extrinsics_beside(const fs::path& file) {
  for (const char* name : {"extrinsics.yml", "extrinsics.yaml", "extrinsics.xml"}) {
    if (fs::exists(file.parent_path() / name)) return file.parent_path() / name;
  }
  return {};
}

Eigen::Isometry3d read_T_right_left(const OpenCvFile& file) {
  const auto R = file.numbers({"R"}, 9, 9);
  const auto T = file.numbers({"T"}, 3, 3);
  Eigen::Isometry3d T_right_left = Eigen::Isometry3d::Identity();
  T_right_left.linear() = rotation_of(Eigen::Map<const RowMajor3>(R.data()), file.path(), "R");
  T_right_left.translation() = Eigen::Map<const Eigen::Vector3d>(T.data());
  return T_right_left;
}

/// R and T of the file, else of extrinsics.yml beside it. Throws std::runtime_error if the two differ.
Eigen::Isometry3d read_extrinsics(const OpenCvFile& file) {
  const fs::path beside = extrinsics_beside(file.path());
  if (file.find({"T"}).empty()) {
    if (beside.empty())
      fail(file.path(), "has no T; add R and T of cv::stereoCalibrate, or extrinsics.yml beside it");
    return read_T_right_left(OpenCvFile(beside));
  }
  Eigen::Isometry3d T_right_left = read_T_right_left(file);
  if (beside.empty() || fs::equivalent(beside, file.path())) return T_right_left;
  const OpenCvFile other(beside);
  if (!other.find({"T"}).empty() && !agree(T_right_left, read_T_right_left(other))) {
    fail(file.path(),
         fmt::format("has other R and T than {} beside it; remove those of the earlier calibration",
                     beside.filename().string()));
  }
  return T_right_left;
}

OwnCamera read_opencv_stereo(const fs::path& path) {
  const OpenCvFile file(path);
  StereoRig rig;
  rig.left = read_opencv_lens(file, {{"M1", "K1", "cameraMatrix1", "camera_matrix_1"},
                                     {"D1", "distCoeffs1", "distortion_coefficients_1"}});
  rig.right = read_opencv_lens(file, {{"M2", "K2", "cameraMatrix2", "camera_matrix_2"},
                                      {"D2", "distCoeffs2", "distortion_coefficients_2"}});
  rig.T_right_left = read_extrinsics(file);
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
  set_camera_matrix(info.lens, ros_numbers(map, "camera_matrix", 9), fail_here);
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

using CameraProjection = decltype(CameraInfo::P);
constexpr double kSameProjection = 1e-6;  // relative tolerance

/// Throws std::invalid_argument if P is not [fx 0 cx Tx; 0 fy cy 0; 0 0 1 0]. `baseline` is |Tx| of the right
/// camera.
void require_projection(const CameraProjection& P, double baseline, std::string_view side) {
  constexpr double kMostAcross = 0.01;  // of the baseline
  Eigen::Matrix3d pinhole = Eigen::Matrix3d::Identity();
  pinhole(0, 0) = P(0, 0);
  pinhole(1, 1) = P(1, 1);
  pinhole.topRightCorner<2, 1>() = P.block<2, 1>(0, 2);
  if (!((P.leftCols<3>() - pinhole).cwiseAbs().maxCoeff() <= kSameProjection * P(0, 0) && P(1, 1) > 0.0)) {
    throw std::invalid_argument(fmt::format(
        "the projection matrix of the {} camera is not [fx 0 cx Tx; 0 fy cy 0; 0 0 1 0]; calibrate the two "
        "cameras as a stereo pair",
        side));
  }
  const double across = std::max(std::abs(P(1, 3)), P(1, 1) * std::abs(P(2, 3)));
  if (across > kMostAcross * baseline) {
    throw std::invalid_argument(fmt::format(
        "the projection matrix of the {} camera has the fourth column ({:.6g}, {:.6g}, {:.6g}), but its "
        "second and third numbers must be 0: rectified cameras lie side by side; calibrate the two cameras "
        "as a stereo pair",
        side, P(0, 3), P(1, 3), P(2, 3)));
  }
}

/// Throws std::invalid_argument if the P of the two cameras are not of one stereo rectification. The
/// principal points may differ in x, as the right images may be shifted along their rows.
void require_stereo(const CameraProjection& left, const CameraProjection& right) {
  if (right(0, 3) == 0.0 && left(0, 3) != 0.0) {
    throw std::invalid_argument(
        "the baseline is in the projection matrix of the left camera, not in that of the right one; the two "
        "are swapped: name them the other way round");
  }
  if (!(right(0, 0) > 0.0) || right(0, 3) == 0.0) {
    throw std::invalid_argument(
        "the projection matrix has no baseline, P[3] = -fx * baseline; calibrate the two cameras as a stereo "
        "pair");
  }
  const double baseline = std::abs(right(0, 3));
  require_projection(left, baseline, "left");
  require_projection(right, baseline, "right");
  if (std::abs(left(0, 3)) > kSameProjection * baseline) {
    throw std::invalid_argument(
        "the projection matrices of both cameras have a baseline, P[3]; that of the left one must be 0");
  }
  struct Element {
    std::string_view name;
    int row;
    int column;
  };
  for (const auto& [name, row, column] : {Element{"fx", 0, 0}, Element{"fy", 1, 1}, Element{"cy", 1, 2}}) {
    if (std::abs(left(row, column) - right(row, column)) <= kSameProjection * left(0, 0)) continue;
    throw std::invalid_argument(fmt::format(
        "the projection matrices of the two cameras contradict each other: {} is {:.8g} in that of the left "
        "camera and {:.8g} in that of the right one; use the results of one stereo calibration",
        name, left(row, column), right(row, column)));
  }
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
  require_stereo(left.P, right.P);
  // Both rectified cameras have the same axes; the right one lies at -P[3] / fx on the left one's x axis.
  const Eigen::Translation3d T_right_left_rectified(right.P(0, 3) / right.P(0, 0), 0.0, 0.0);
  StereoRig rig;
  rig.left = left.lens;
  rig.right = right.lens;
  rig.T_right_left = Eigen::Isometry3d(Eigen::Quaterniond(right.R).conjugate()) * T_right_left_rectified *
                     Eigen::Quaterniond(left.R);
  return rig;
}

StereoCamera rectified_of(const CameraInfo& left, const CameraInfo& right) {
  require_stereo(left.P, right.P);
  const auto& P = right.P;
  if (std::abs(left.P(0, 2) - P(0, 2)) > kSameProjection * P(0, 0)) {
    throw std::invalid_argument(fmt::format(
        "the projection matrices have the principal points cx = {:.6g} in the left and {:.6g} in the right "
        "camera: the cameras were calibrated without zero disparity, which is not read for rectified images; "
        "calibrate with CALIB_ZERO_DISPARITY, or name the topics of the raw images, which this program "
        "rectifies: --left-topic, --right-topic",
        left.P(0, 2), P(0, 2)));
  }
  if (left.lens.width_px != right.lens.width_px || left.lens.height_px != right.lens.height_px) {
    throw std::invalid_argument(fmt::format(
        "the image size is {}x{} for the left camera and {}x{} for the right one; both must have one size",
        left.lens.width_px, left.lens.height_px, right.lens.width_px, right.lens.height_px));
  }
  return {.fx = P(0, 0),
          .fy = P(1, 1),
          .cx = P(0, 2),
          .cy = P(1, 2),
          .baseline_m = -P(0, 3) / P(0, 0),
          .width_px = left.lens.width_px,
          .height_px = left.lens.height_px};
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
