// SPDX-License-Identifier: MIT
#pragma once

#include <pybind11/numpy.h>

#include <opencv2/core.hpp>

/// The image in a numpy array, not copied: rows x columns, or rows x columns x channels with 1, 3 (BGR) or 4
/// (BGRA) channels, of uint8 or uint16; rows may be apart. Valid as long as the array. None is an empty
/// image. Throws std::invalid_argument, with the shape and the type, for other arrays.
[[nodiscard]] cv::Mat image_in(const pybind11::object& array);
