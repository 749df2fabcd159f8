// SPDX-License-Identifier: MIT
#pragma once

#include <random>

#include <opencv2/core.hpp>

#include "box_model.hpp"

namespace object_pose {

/// What is printed on a package: letters, a mountain, shapes and small print, other ones for every draw. The
/// letters recur, so that a feature has doubles.
[[nodiscard]] cv::Mat1b print_face(cv::Size size_px, std::mt19937_64& rng);

/// A box with six printed faces.
[[nodiscard]] BoxModel print_box(const BoxSize& size_m, std::mt19937_64& rng);

/// A wall with patches of light and dark.
[[nodiscard]] cv::Mat1b paint_wall(cv::Size size_px, std::mt19937_64& rng);

}  // namespace object_pose
