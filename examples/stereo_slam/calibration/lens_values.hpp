// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "stereo_slam/calibration/stereo_rig.hpp"

/// The values of a lens as calibration files of every format give them, with their bounds.
namespace stereo_slam {

/// Throws an exception with the file, the line and the given text.
using Fail = std::function<void(const std::string&)>;

/// [width, height] in pixels.
void set_size(Lens& lens, const std::vector<double>& size, const Fail& fail);

/// [fx, fy, cx, cy] in pixels. The principal point has to be inside the image, if its size is known.
void set_pinhole(Lens& lens, const std::vector<double>& intrinsics, const Fail& fail);

/// The pinhole of a camera matrix, nine numbers row by row, which must be [fx 0 cx; 0 fy cy; 0 0 1].
void set_camera_matrix(Lens& lens, const std::vector<double>& K, const Fail& fail);

/// Whether this is one of the names of a distortion model.
[[nodiscard]] bool is_model_name(std::string_view name);

/// The distortion model by one of its names.
void set_model(Lens& lens, std::string_view name, const Fail& fail);

/// The coefficients of the lens's model, in OpenCV's order. Of OpenCV's thin prism and tilted models only
/// what they have in common with radtan can be used: the rest has to be zero. So has a fifth coefficient of
/// equidistant, which RealSense cameras give.
void set_coefficients(Lens& lens, std::vector<double> coefficients, const Fail& fail);

/// Whether two statements of one pose agree, but for rounding: to half a degree, and to 1 mm and 2 %.
[[nodiscard]] bool agree(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b);

}  // namespace stereo_slam
