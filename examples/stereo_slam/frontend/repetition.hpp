// SPDX-License-Identifier: MIT
#pragma once

#include <opencv2/core/mat.hpp>

namespace stereo_slam {

/// Whether the middle of a grey image looks the same after a shift, as a chessboard or a tiled wall does. A
/// camera that moves by such a shift cannot be told from one that stands still.
///
/// The region compared is the central 640 x 480 pixels, or less if the image is smaller. The patch in its
/// middle, with half its side lengths, is compared with all patches of the same size in the region, at a
/// quarter of the resolution, by normalised cross-correlation.
[[nodiscard]] bool repeats_itself(const cv::Mat& image);

}  // namespace stereo_slam
