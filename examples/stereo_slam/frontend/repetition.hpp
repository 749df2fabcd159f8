// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>

#include <opencv2/core/mat.hpp>

namespace stereo_slam {

/// Whether the middle of a grey image looks the same after a shift, as a chessboard or a tiled wall does. A
/// camera that moves by such a shift cannot be told from one that stands still.
///
/// The region compared is the central 640 x 480 pixels, or less if the image is smaller. The patch in its
/// middle, with half its side lengths, is compared with all patches of the same size in the region, at a
/// quarter of the resolution, by normalised cross-correlation.
[[nodiscard]] bool repeats_itself(const cv::Mat& image);

/// Whether the scene in view repeats itself. The comparison takes a tenth of the time of a frame, and a scene
/// changes slowly, so that only some of the keyframes are compared.
class SceneRepetition {
 public:
  /// Returns repeats_itself() of the last keyframe that was compared. That is the given one, if no keyframe
  /// was compared in the last five frames. `keyframe` and `frame` are the indices of the keyframe and of the
  /// current frame.
  [[nodiscard]] bool repeats_itself(const cv::Mat& keyframe_image, std::size_t keyframe, std::size_t frame);

 private:
  /// The last comparison.
  struct Comparison {
    std::size_t keyframe = 0;
    std::size_t frame = 0;
    bool repeats_itself = false;
  };
  std::optional<Comparison> last_;
};

}  // namespace stereo_slam
