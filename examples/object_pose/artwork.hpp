// SPDX-License-Identifier: MIT
#pragma once

#include <random>

#include <opencv2/core.hpp>

#include "box_model.hpp"

namespace object_pose {

/// A random texture like that of a printed package: words, a mountain, shapes, small print and bars. Letters
/// recur, so that some features look like others.
[[nodiscard]] cv::Mat1b print_face(cv::Size size_px, std::mt19937_64& rng);

/// A box with six printed faces.
[[nodiscard]] BoxModel print_box(const BoxSize& size_m, std::mt19937_64& rng);

/// A random texture for a wall: patches of light and dark, shapes and words.
[[nodiscard]] cv::Mat1b paint_wall(cv::Size size_px, std::mt19937_64& rng);

}  // namespace object_pose
