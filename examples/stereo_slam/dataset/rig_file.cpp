// SPDX-License-Identifier: MIT
#include "stereo_slam/dataset/rig_file.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <set>
#include <stdexcept>
#include <vector>

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include "stereo_slam/dataset/image_size.hpp"
#include "stereo_slam/io/text_file.hpp"
#include "stereo_slam/settings/yaml_file.hpp"

namespace stereo_slam {
namespace {

namespace fs = std::filesystem;

/// A map of a YAML file. Errors name file and line.
class YamlMap {
 public:
  YamlMap(fs::path file, const YAML::Node& node, std::string name)
      : file_(std::move(file)), node_(node), name_(std::move(name)) {
    if (!node_.IsMap()) fail(node_, fmt::format("{} must contain `key: value` lines", name_));
  }

  [[noreturn]] void fail(const YAML::Node& where, const std::string& what) const {
    const int line = where.IsDefined() ? where.Mark().line + 1 : 1;
    throw std::runtime_error(at_line(file_, std::max(line, 1), what));
  }
  [[noreturn]] void fail(const std::string& what) const { fail(node_, what); }

  [[nodiscard]] bool has(const std::string& key) const { return node_[key].IsDefined(); }

  /// The value of the first key present, of keys with the same meaning.
  [[nodiscard]] YAML::Node get(std::initializer_list<const char*> keys) const {
    for (const auto* key : keys) {
      if (has(key)) return node_[key];
    }
    fail(fmt::format("{} has no {}; add it", name_, *keys.begin()));
  }

  [[nodiscard]] YamlMap map(const std::string& key) const { return {file_, get({key.c_str()}), key}; }

  [[nodiscard]] std::string text(std::initializer_list<const char*> keys) const {
    const YAML::Node node = get(keys);
    if (!node.IsScalar() || node.Scalar().empty())
      fail(node, fmt::format("{} must be one word", *keys.begin()));
    return node.Scalar();
  }

  [[nodiscard]] double number(const char* key) const {
    const YAML::Node node = get({key});
    std::vector<double> values;
    if (node.IsScalar()) append(node, key, values);
    if (values.size() != 1) fail(node, fmt::format("{} must be one number", key));
    return values.front();
  }

  /// All numbers of a list, nested or not.
  [[nodiscard]] std::vector<double> numbers(std::initializer_list<const char*> keys) const {
    const YAML::Node node = get(keys);
    if (!node.IsSequence()) fail(node, fmt::format("{} must be a list of numbers in [ ]", *keys.begin()));
    std::vector<double> values;
    append(node, *keys.begin(), values);
    return values;
  }

  /// A rigid motion: 16 numbers row by row, as a list, as four lists, or as `data` of a map.
  [[nodiscard]] Eigen::Isometry3d transform(const char* key) const {
    const YAML::Node node = get({key});
    const YAML::Node data = node.IsMap() ? node["data"] : node;
    if (!data.IsDefined() || !data.IsSequence()) fail(node, fmt::format("{} needs a 4x4 matrix", key));
    std::vector<double> values;
    append(data, key, values);
    if (values.size() != 16)
      fail(node, fmt::format("{} has {} numbers, but a 4x4 matrix has 16", key, values.size()));
    using RowMajor = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;
    const Eigen::Matrix4d T = Eigen::Map<const RowMajor>(values.data());
    const Eigen::Matrix3d R = T.topLeftCorner<3, 3>();
    constexpr double kTolerance = 1e-2;  // admits files with three digits
    const bool rotation =
        (R * R.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < kTolerance &&
        R.determinant() > 0.0;
    if (!rotation || !T.row(3).isApprox(Eigen::RowVector4d(0.0, 0.0, 0.0, 1.0), kTolerance)) {
      fail(node, fmt::format("{} is not a rigid motion [R t; 0 0 0 1] with a rotation R", key));
    }
    return Eigen::Translation3d(T.topRightCorner<3, 1>()) * Eigen::Quaterniond(R).normalized();
  }

  void refuse_unknown_keys(const std::set<std::string>& known) const {
    for (const auto& entry : node_) {
      if (entry.first.IsScalar() && known.contains(entry.first.Scalar())) continue;
      fail(entry.first,
           fmt::format("{} has an unknown key {}; known are {}", name_,
                       entry.first.IsScalar() ? entry.first.Scalar() : "[...]", fmt::join(known, ", ")));
    }
  }

 private:
  void append(const YAML::Node& node, const char* key, std::vector<double>& values) const {
    if (node.IsSequence()) {
      for (const auto& part : node) append(part, key, values);
      return;
    }
    const auto parsed = node.IsScalar() ? parse_numbers(node.Scalar()) : std::nullopt;
    if (!parsed || parsed->size() != 1) {
      fail(node, fmt::format("{} holds '{}', which is not a finite number", key,
                             node.IsScalar() ? node.Scalar() : "..."));
    }
    values.push_back(parsed->front());
  }

  fs::path file_;
  YAML::Node node_;
  std::string name_;
};

YamlMap load(const fs::path& file, const std::string& advice) {
  if (!fs::exists(file)) throw std::runtime_error(fmt::format("{}: missing; {}", file.string(), advice));
  return {file, load_yaml_file(file), "the file"};
}

struct Model {
  std::string_view name;
  Distortion distortion;
};
constexpr Model kModels[] = {{"radtan", Distortion::kRadTan},    {"equidistant", Distortion::kEquidistant},
                             {"none", Distortion::kNone},        {"radial-tangential", Distortion::kRadTan},
                             {"plumb_bob", Distortion::kRadTan}, {"fisheye", Distortion::kEquidistant}};

void read_distortion(const YamlMap& map, Lens& lens) {
  const std::string name = map.text({"distortion_model"});
  const auto* model =
      std::find_if(std::begin(kModels), std::end(kModels), [&](const auto& m) { return m.name == name; });
  if (model == std::end(kModels)) {
    map.fail(map.get({"distortion_model"}),
             fmt::format("distortion_model is {}, but must be radtan (radial-tangential, plumb_bob), "
                         "equidistant (fisheye) or none; calibrate with one of them",
                         name));
  }
  lens.distortion = model->distortion;
  if (lens.distortion == Distortion::kNone) return;
  lens.coefficients = map.numbers({"distortion_coefficients", "distortion_coeffs"});
  const auto count = lens.coefficients.size();
  const bool radtan = lens.distortion == Distortion::kRadTan;
  if (count != 4 && !(radtan && (count == 5 || count == 8))) {
    map.fail(map.get({"distortion_coefficients", "distortion_coeffs"}),
             fmt::format("{} has {} distortion coefficients, but needs {}", name, count,
                         radtan ? "4, 5 or 8 (k1 k2 p1 p2 [k3 [k4 k5 k6]])" : "4 (k1 k2 k3 k4)"));
  }
}

Lens read_lens(const YamlMap& map) {
  if (map.has("camera_model") && map.text({"camera_model"}) != "pinhole") {
    map.fail(map.get({"camera_model"}),
             fmt::format("camera_model is {}, but must be pinhole; calibrate with that model",
                         map.text({"camera_model"})));
  }
  Lens lens;
  const auto resolution = map.numbers({"resolution"});
  constexpr double kMaxSide_px = 20000.0;
  const auto is_side = [](double x) { return x >= 16.0 && x <= kMaxSide_px && x == std::floor(x); };
  if (resolution.size() != 2 || !std::all_of(resolution.begin(), resolution.end(), is_side)) {
    map.fail(map.get({"resolution"}), "resolution must be [width, height] in pixels");
  }
  lens.width_px = static_cast<int>(resolution[0]);
  lens.height_px = static_cast<int>(resolution[1]);
  if (static_cast<std::uint64_t>(lens.width_px) * static_cast<std::uint64_t>(lens.height_px) > kMostPixels) {
    map.fail(map.get({"resolution"}), fmt::format("resolution is {} x {}; images may have up to {} pixels",
                                                  lens.width_px, lens.height_px, kMostPixels));
  }
  const auto intrinsics = map.numbers({"intrinsics"});
  if (intrinsics.size() != 4) {
    map.fail(map.get({"intrinsics"}),
             fmt::format("intrinsics has {} numbers, but must be [fx, fy, cx, cy]", intrinsics.size()));
  }
  lens.fx = intrinsics[0];
  lens.fy = intrinsics[1];
  lens.cx = intrinsics[2];
  lens.cy = intrinsics[3];
  if (!(lens.fx > 0.0 && lens.fy > 0.0)) {
    map.fail(map.get({"intrinsics"}),
             fmt::format("intrinsics has focal lengths {} and {}; both must be positive", lens.fx, lens.fy));
  }
  if (!(lens.cx > 0.0 && lens.cx < lens.width_px && lens.cy > 0.0 && lens.cy < lens.height_px)) {
    map.fail(map.get({"intrinsics"}),
             fmt::format("the principal point ({}, {}) lies outside the {}x{} images; intrinsics is [fx, fy, "
                         "cx, cy]",
                         lens.cx, lens.cy, lens.width_px, lens.height_px));
  }
  read_distortion(map, lens);
  return lens;
}

std::optional<Eigen::Isometry3d> read_T_body_camera(const YamlMap& map) {
  if (map.has("T_BS")) return map.transform("T_BS");
  if (map.has("T_cam_imu")) return map.transform("T_cam_imu").inverse();
  return std::nullopt;
}

StereoRig read_rig(const YamlMap& left, const YamlMap& right) {
  StereoRig rig{.left = read_lens(left), .right = read_lens(right), .T_right_left = {}, .T_body_left = {}};
  if (rig.left.width_px != rig.right.width_px || rig.left.height_px != rig.right.height_px) {
    right.fail(right.get({"resolution"}),
               fmt::format("resolution is {}x{}, but the left camera has {}x{}; both must have one size",
                           rig.right.width_px, rig.right.height_px, rig.left.width_px, rig.left.height_px));
  }
  rig.T_body_left = read_T_body_camera(left);
  const auto T_body_right = read_T_body_camera(right);
  if (rig.T_body_left && T_body_right) {
    rig.T_right_left = T_body_right->inverse() * *rig.T_body_left;
  } else if (right.has("T_cn_cnm1")) {
    rig.T_right_left = right.transform("T_cn_cnm1");
  } else {
    (rig.T_body_left ? right : left)
        .fail(
            "no T_BS; add the pose of the camera in the body as a 4x4 matrix in metres (or T_cam_imu of "
            "both cameras, or T_cn_cnm1 of the right one)");
  }
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
  const YamlMap map = load(file, "copy the calibration of both cameras from the recording");
  return read_rig(map.map("cam0"), map.map("cam1"));
}

OwnCamera read_own_camera(const fs::path& file) {
  const YamlMap map = load(file, "write the calibration as docs/datasets.md describes");
  map.refuse_unknown_keys(
      {"left", "right", "T_right_left", "T_body_left", "rectified", "frame_rate_hz", "times"});
  OwnCamera own;
  const bool rectified = map.has("rectified");
  for (const auto* side : {"left", "right"}) {
    if (!map.has(side)) {
      if (!rectified)
        map.fail(
            fmt::format("there is neither '{}' nor 'rectified'; add the calibration of the camera", side));
      continue;
    }
    const YamlMap camera = map.map(side);
    if (rectified) {
      camera.refuse_unknown_keys({"source"});
    } else {
      camera.refuse_unknown_keys({"source", "camera_model", "resolution", "intrinsics", "distortion_model",
                                  "distortion_coefficients"});
    }
    if (camera.has("source"))
      (std::string_view(side) == "left" ? own.left_source : own.right_source) = camera.text({"source"});
  }
  std::optional<Eigen::Isometry3d> T_body_left;
  if (map.has("T_body_left")) T_body_left = map.transform("T_body_left");
  if (rectified) {
    const YamlMap camera = map.map("rectified");
    camera.refuse_unknown_keys({"fx", "fy", "cx", "cy", "baseline_m"});
    own.rectified = StereoCamera{.fx = camera.number("fx"),
                                 .fy = camera.number("fy"),
                                 .cx = camera.number("cx"),
                                 .cy = camera.number("cy"),
                                 .baseline_m = camera.number("baseline_m")};
    if (!(own.rectified->fx > 0.0 && own.rectified->fy > 0.0)) camera.fail("fx and fy must be positive");
    if (!(own.rectified->baseline_m > 0.0)) {
      camera.fail(
          map.get({"rectified"})["baseline_m"],
          fmt::format("baseline_m is {}, but must be positive, in metres", own.rectified->baseline_m));
    }
    own.T_body_camera = T_body_left;
  } else {
    StereoRig rig{.left = read_lens(map.map("left")),
                  .right = read_lens(map.map("right")),
                  .T_right_left = map.transform("T_right_left"),
                  .T_body_left = T_body_left};
    own.rig = std::move(rig);
  }
  if (map.has("frame_rate_hz")) {
    own.frame_rate_hz = map.number("frame_rate_hz");
    constexpr double kSlowest_hz = 0.01;
    constexpr double kFastest_hz = 1e5;
    if (!(*own.frame_rate_hz >= kSlowest_hz && *own.frame_rate_hz <= kFastest_hz)) {
      map.fail(map.get({"frame_rate_hz"}), fmt::format("frame_rate_hz is {}, but must be from {} to {}",
                                                       *own.frame_rate_hz, kSlowest_hz, kFastest_hz));
    }
  }
  if (map.has("times")) own.times = map.text({"times"});
  return own;
}

}  // namespace stereo_slam
