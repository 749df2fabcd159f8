// SPDX-License-Identifier: MIT
#pragma once

#include <opencv2/core/mat.hpp>

namespace stereo_slam {

/// Whether the middle of a grey image looks the same after a shift, as a chessboard or a tiled wall does. A
/// camera that moves by such a shift cannot be told from one that stands still.
///
/// The middle is compared with its surroundings, up to 320 x 240 pixels about it, at a quarter of the
/// resolution, by normalised cross-correlation.
[[nodiscard]] bool repeats_itself(const cv::Mat& image);

}  // namespace stereo_slam
