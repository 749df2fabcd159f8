// SPDX-License-Identifier: MIT
#include "box_model.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <stdexcept>

#include <fmt/format.h>
#include <fmt/ostream.h>
#include <opencv2/imgcodecs.hpp>
#include <yaml-cpp/yaml.h>

namespace object_pose {
namespace {

namespace fs = std::filesystem;

constexpr const char* kModelName = "model.yaml";

/// The directions of the columns and rows of a face's texture, in object coordinates.
struct FaceAxes {
  Eigen::Vector3d right, down;
};

FaceAxes axes_of(std::string_view name) {
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), y = Eigen::Vector3d::UnitY(),
                        z = Eigen::Vector3d::UnitZ();
  if (name == "front") return {x, -z};
  if (name == "right") return {y, -z};
  if (name == "back") return {-x, -z};
  if (name == "left") return {-y, -z};
  if (name == "top") return {x, -y};
  if (name == "bottom") return {x, y};
  throw std::runtime_error(
      fmt::format("a box has no face '{}'; it has {}", name, fmt::join(kFaceNames, ", ")));
}

/// The positive number map[key]; `group` is the name of the map for the error.
double read_number(const fs::path& file, const YAML::Node& map, const char* group, const char* key) {
  try {
    const double value = map[key].as<double>();
    if (std::isfinite(value) && value > 0.0) return value;
  } catch (const YAML::Exception&) {
    // reported below, with the key
  }
  throw std::runtime_error(fmt::format("{}: {}.{} must be a positive number", file.string(), group, key));
}

YAML::Node read_map(const fs::path& file, const YAML::Node& document, const char* key) {
  const YAML::Node map = document[key];
  if (!map || !map.IsMap()) throw std::runtime_error(fmt::format("{}: no map '{}'", file.string(), key));
  return map;
}

YAML::Node parse(const fs::path& file) {
  if (!fs::is_regular_file(file)) throw std::runtime_error(fmt::format("no model at {}", file.string()));
  try {
    const YAML::Node document = YAML::LoadFile(file.string());
    if (!document.IsMap()) throw std::runtime_error(fmt::format("{}: not a map", file.string()));
    return document;
  } catch (const YAML::ParserException& error) {
    throw std::runtime_error(fmt::format("{}:{}: {}", file.string(), error.mark.line + 1, error.msg));
  }
}

StereoCamera read_camera(const fs::path& file, const YAML::Node& map) {
  const auto number = [&](const char* key) { return read_number(file, map, "camera", key); };
  return {.fx = number("fx"),
          .fy = number("fy"),
          .cx = number("cx"),
          .cy = number("cy"),
          .baseline_m = number("baseline_m"),
          .width_px = static_cast<int>(number("width_px")),
          .height_px = static_cast<int>(number("height_px"))};
}

}  // namespace

Eigen::Matrix<double, 3, 8> corners_of(const BoxSize& size_m) {
  Eigen::Matrix<double, 3, 8> corners;
  for (int k = 0; k < 8; ++k) {
    corners.col(k) =
        0.5 * size_m.cwiseProduct(Eigen::Vector3d(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1));
  }
  return corners;
}

BoxFace make_face(const BoxSize& size_m, std::string_view name, const cv::Mat1b& texture) {
  constexpr double kMaxDistortion = 0.02;
  const auto [right, down] = axes_of(name);
  const Eigen::Vector3d inward = right.cross(down);
  const Eigen::Vector2d face_m(std::abs(right.dot(size_m)), std::abs(down.dot(size_m)));
  const double distortion = (texture.cols / face_m.x()) / (texture.rows / face_m.y());
  if (!(std::abs(distortion - 1.0) <= kMaxDistortion)) {
    throw std::runtime_error(
        fmt::format("the texture of face '{}' is {} x {} px, but the face is {} x {} m: other proportions",
                    name, texture.cols, texture.rows, face_m.x(), face_m.y()));
  }
  Eigen::Matrix3d R;
  R << right, down, inward;
  const double depth_m = std::abs(inward.dot(size_m));
  return {std::string(name), texture, face_m, Pose::from_matrix(R, -0.5 * depth_m * inward)};
}

ModelFile load_model(const fs::path& folder) {
  const fs::path file = folder / kModelName;
  const YAML::Node document = parse(file);
  ModelFile model;
  model.camera = read_camera(file, read_map(file, document, "camera"));
  const YAML::Node box = read_map(file, document, "box");
  model.box.size_m = {read_number(file, box, "box", "width_m"), read_number(file, box, "box", "depth_m"),
                      read_number(file, box, "box", "height_m")};
  for (const auto& entry : read_map(file, document, "faces")) {
    if (!entry.second.IsScalar()) {
      throw std::runtime_error(
          fmt::format("{}: every entry of 'faces' must name an image file", file.string()));
    }
    try {
      const cv::Mat1b texture = load_image(folder / entry.second.Scalar());
      model.box.faces.push_back(make_face(model.box.size_m, entry.first.Scalar(), texture));
    } catch (const std::runtime_error& error) {
      throw std::runtime_error(fmt::format("{}: {}", file.string(), error.what()));
    }
  }
  if (model.box.faces.empty()) throw std::runtime_error(fmt::format("{}: no faces", file.string()));
  return model;
}

void write_model(const fs::path& folder, const ModelFile& model) {
  fs::create_directories(folder);
  const fs::path file = folder / kModelName;
  std::ofstream stream(file);
  const auto& [fx, fy, cx, cy, baseline_m, width_px, height_px] = model.camera;
  fmt::print(stream,
             "# A box and the rectified stereo cameras that see it; see docs/mixtures.md.\n"
             "camera:  # pixel centres have integer coordinates\n"
             "  width_px: {}\n  height_px: {}\n  fx: {}\n  fy: {}\n  cx: {}\n  cy: {}\n  baseline_m: {}\n"
             "box:     # width along the front, depth from front to back\n"
             "  width_m: {}\n  depth_m: {}\n  height_m: {}\n"
             "faces:   # orthogonal views from outside: front, right, back and left upright, top with the\n"
             "         # front at the bottom of the image, bottom with the front at the top of the image.\n"
             "         # Leave out the faces that you have no image of.\n",
             width_px, height_px, fx, fy, cx, cy, baseline_m, model.box.size_m.x(), model.box.size_m.y(),
             model.box.size_m.z());
  for (const auto& face : model.box.faces) {
    fmt::print(stream, "  {0}: {0}.png\n", face.name);
    write_image(folder / (face.name + ".png"), face.texture);
  }
  if (!stream.flush()) throw std::runtime_error(fmt::format("cannot write {}", file.string()));
}

cv::Mat1b load_image(const fs::path& file) {
  if (!fs::is_regular_file(file)) throw std::runtime_error(fmt::format("no image at {}", file.string()));
  cv::Mat image = cv::imread(file.string(), cv::IMREAD_GRAYSCALE);
  if (image.empty()) throw std::runtime_error(fmt::format("{} is not an image", file.string()));
  return image;
}

void write_image(const fs::path& file, const cv::Mat& image) {
  bool written = false;
  try {
    written = cv::imwrite(file.string(), image, {cv::IMWRITE_PNG_COMPRESSION, 9});
  } catch (const cv::Exception&) {
    // thrown for an unknown extension; reported below
  }
  if (!written) throw std::runtime_error(fmt::format("cannot write {}", file.string()));
}

}  // namespace object_pose
