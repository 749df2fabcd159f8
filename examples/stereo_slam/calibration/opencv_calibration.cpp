// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "stereo_slam/calibration/calibration_formats.hpp"
#include "stereo_slam/calibration/given_distortion.hpp"
#include "stereo_slam/calibration/lens_values.hpp"
#include "stereo_slam/io/file_error.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;
using RowMajor3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

/// R, made exactly orthonormal, as files hold rounded numbers. Throws std::runtime_error if R is no rotation.
Eigen::Matrix3d rotation_of(const RowMajor3& R, const fs::path& file, std::string_view name) {
  constexpr double kTolerance = 1e-2;
  const double error = (R * R.transpose() - RowMajor3::Identity()).cwiseAbs().maxCoeff();
  if (!(error < kTolerance && R.determinant() > 0.0)) fail(file, "{} is not a rotation", name);
  return Eigen::Quaterniond(Eigen::Matrix3d(R)).normalized().toRotationMatrix();
}

/// A file of OpenCV's FileStorage. It is not read by OpenCV, whose parsers crash or do not end for some
/// damaged files.
class OpenCvFile {
 public:
  explicit OpenCvFile(const CalibrationText& text) : file_(text.file), root_(text.root()) {
    if (!root_.IsMap()) fail(file_, "is no file of named values; write it by cv::FileStorage");
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
    if (key.empty()) fail(file_, "has no {}; write it by cv::FileStorage", fmt::join(keys, " or "));
    const std::string other = find_another(key, keys);
    if (!other.empty()) fail(file_, "has both {} and {}, which are the same; remove one", key, other);
    const YAML::Node node = root_[key];
    std::vector<double> values;
    append(node.IsMap() ? node["data"] : node, most, values);
    const bool finite = std::ranges::all_of(values, [](double x) { return std::isfinite(x); });
    if (values.size() < least || values.size() > most || !finite)
      fail(file_, "{} is not a matrix or a list of {}{} finite numbers", key, least,
           most > least ? fmt::format(" to {}", most) : "");
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
  const auto whole = {"image_size", "imageSize", "size"};
  const auto width = {"image_width", "image_Width", "imageSize_width", "width"};
  const auto height = {"image_height", "image_Height", "imageSize_height", "height"};
  if (!file.find(whole).empty()) {
    set_size(lens, file.numbers(whole, 2, 2), fail_here);
  } else if (!file.find(width).empty()) {
    set_size(lens, {file.numbers(width, 1, 1)[0], file.numbers(height, 1, 1)[0]}, fail_here);
  }
}

/// The name of the distortion model: `distortion_model`, or another key that says it.
[[nodiscard]] std::string read_opencv_model(const OpenCvFile& file) {
  if (std::string model = file.text("distortion_model"); !model.empty()) return model;
  for (const char* key : {"fisheye_model", "fisheye", "use_fisheye", "is_fisheye", "isFisheye"}) {
    const std::string value = file.text(key);
    if (value == "1" || value == "true" || value == "True") return "fisheye";
    if (value == "0" || value == "false" || value == "False") return "radtan";
  }
  for (const char* key :
       {"model", "model_type", "camera_model", "camera_type", "lens_model", "projection_model"}) {
    std::string value = file.text(key);
    if (is_model_name(value)) return value;
  }
  return "";
}

struct LensKeys {
  std::initializer_list<const char*> matrix;
  std::initializer_list<const char*> coefficients;
};

Lens read_opencv_pinhole(const OpenCvFile& file, const LensKeys& keys) {
  Lens lens;
  read_opencv_size(file, lens);
  set_camera_matrix(lens, file.numbers(keys.matrix, 9, 9), [&](const std::string& what) {
    fail(file.path(), file.find(keys.matrix) + ": " + what);
  });
  return lens;
}

GivenDistortion read_opencv_distortion(const OpenCvFile& file, const LensKeys& keys) {
  constexpr std::size_t kMostCoefficients = 14;
  GivenDistortion distortion{read_opencv_model(file), {}};
  if (distortion.model != "none")
    distortion.coefficients = file.numbers(keys.coefficients, 4, kMostCoefficients);
  return distortion;
}

/// The file extrinsics.yml beside another, as OpenCV's sample names it; empty if there is none.
fs::path extrinsics_beside(const fs::path& file) {
  for (const char* name : {"extrinsics.yml", "extrinsics.yaml", "extrinsics.xml"}) {
    if (fs::exists(file.parent_path() / name)) return file.parent_path() / name;
  }
  return {};
}

/// R as a matrix or as a rotation vector, and T.
Eigen::Isometry3d read_T_right_left(const OpenCvFile& file) {
  constexpr std::size_t kVector = 3;
  const auto R = file.numbers({"R"}, kVector, 9);
  const auto T = file.numbers({"T"}, 3, 3);
  Eigen::Isometry3d T_right_left = Eigen::Isometry3d::Identity();
  if (R.size() == kVector) {
    const Eigen::Vector3d r = Eigen::Map<const Eigen::Vector3d>(R.data());
    T_right_left.linear() = Eigen::AngleAxisd(r.norm(), r.stableNormalized()).toRotationMatrix();
  } else if (R.size() == 9) {
    T_right_left.linear() = rotation_of(Eigen::Map<const RowMajor3>(R.data()), file.path(), "R");
  } else {
    fail(file.path(), "R is not a matrix or a list of 9 finite numbers, nor a rotation vector of 3");
  }
  T_right_left.translation() = Eigen::Map<const Eigen::Vector3d>(T.data());
  return T_right_left;
}

/// R and T of the file, else of extrinsics.yml beside it. Throws std::runtime_error if the two differ.
Eigen::Isometry3d read_extrinsics(const OpenCvFile& file) {
  const fs::path beside = extrinsics_beside(file.path());
  if (file.find({"T"}).empty()) {
    if (beside.empty())
      fail(file.path(), "has no T; add R and T of cv::stereoCalibrate, or extrinsics.yml beside it");
    return read_T_right_left(OpenCvFile(load_calibration_text(beside)));
  }
  Eigen::Isometry3d T_right_left = read_T_right_left(file);
  if (beside.empty() || fs::equivalent(beside, file.path())) return T_right_left;
  const OpenCvFile other(load_calibration_text(beside));
  if (!other.find({"T"}).empty() && !agree(T_right_left, read_T_right_left(other))) {
    fail(file.path(), "has other R and T than {} beside it; remove those of the earlier calibration",
         beside.filename().string());
  }
  return T_right_left;
}

}  // namespace

OwnCamera read_opencv_stereo(const CalibrationText& text) {
  const OpenCvFile file(text);
  const LensKeys left{{"M1", "K1", "cameraMatrix1", "camera_matrix_1", "cameraMatrixL"},
                      {"D1", "distCoeffs1", "distortion_coefficients_1", "distCoeffsL"}};
  const LensKeys right{{"M2", "K2", "cameraMatrix2", "camera_matrix_2", "cameraMatrixR"},
                       {"D2", "distCoeffs2", "distortion_coefficients_2", "distCoeffsR"}};
  StereoRig rig;
  rig.left = read_opencv_pinhole(file, left);
  rig.right = read_opencv_pinhole(file, right);
  set_distortions(rig, read_opencv_distortion(file, left), read_opencv_distortion(file, right),
                  [&](const std::string& what) { fail(file.path(), what); });
  rig.T_right_left = read_extrinsics(file);
  OwnCamera own;
  own.rig = rig;
  return own;
}

}  // namespace stereo_slam
