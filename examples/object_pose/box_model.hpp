// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include <antipode/geometry/dual_quaternion.hpp>

#include "stereo_slam/core/stereo_camera.hpp"

/// The pose of a textured box, from SIFT features in one stereo pair.
///
///   object   origin in the middle of the box, x to the right of its front, y from front to back, z up
///   face     origin in the middle of a face, x and y as the columns and rows of its texture, z into the box
///   camera   the left one: x right, y down, z forward
namespace object_pose {

/// A pose T_a_b [m].
using Pose = antipode::DualQuaternion<double>;
using stereo_slam::StereoCamera;

inline constexpr std::array<std::string_view, 6> kFaceNames = {"front", "right", "back",
                                                               "left",  "top",   "bottom"};

/// Width (x), depth (y) and height (z) of a box [m].
using BoxSize = Eigen::Vector3d;

/// A face of the box with its texture, an orthogonal view from outside.
struct BoxFace {
  std::string name;  ///< one of kFaceNames
  cv::Mat1b texture;
  Eigen::Vector2d size_m;  ///< along columns and rows
  Pose T_object_face;

  /// Pixels of the texture per metre.
  [[nodiscard]] double px_per_m() const { return texture.cols / size_m.x(); }
  /// Face coordinates (x, y) [m] of a position in the texture [px]; pixel centres have integer coordinates.
  [[nodiscard]] Eigen::Vector2d face_point(double column_px, double row_px) const {
    return {((column_px + 0.5) / texture.cols - 0.5) * size_m.x(),
            ((row_px + 0.5) / texture.rows - 0.5) * size_m.y()};
  }
};

/// The box and its textures.
struct BoxModel {
  BoxSize size_m = BoxSize::Constant(0.2);
  std::vector<BoxFace> faces;  ///< those whose texture is known
};

/// The eight corners, in object coordinates [m].
[[nodiscard]] Eigen::Matrix<double, 3, 8> corners_of(const BoxSize& size_m);

/// A face of a box. Throws std::runtime_error if the name is not one of kFaceNames or the texture does not
/// have the proportions of the face.
[[nodiscard]] BoxFace make_face(const BoxSize& size_m, std::string_view name, const cv::Mat1b& texture);

/// The content of a model folder: the box, and the rectified cameras that see it.
struct ModelFile {
  StereoCamera camera;
  BoxModel box;
};

/// Reads model.yaml of a folder and the textures that it names. Throws std::runtime_error with a message of
/// one line if a file is missing or invalid.
[[nodiscard]] ModelFile load_model(const std::filesystem::path& folder);
/// Writes model.yaml and the textures. Throws std::runtime_error if a file cannot be written.
void write_model(const std::filesystem::path& folder, const ModelFile& model);

/// Reads an image as grey values. Throws std::runtime_error if the file is missing or not an image.
[[nodiscard]] cv::Mat1b load_image(const std::filesystem::path& file);
/// Writes an image. Throws std::runtime_error if this fails.
void write_image(const std::filesystem::path& file, const cv::Mat& image);

}  // namespace object_pose
