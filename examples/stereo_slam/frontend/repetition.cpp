// SPDX-License-Identifier: MIT
#include "stereo_slam/frontend/repetition.hpp"

#include <algorithm>

#include <opencv2/imgproc.hpp>

namespace stereo_slam {
namespace {

constexpr int kScale = 4;  // factor by which the image is reduced for the comparison
constexpr int kMaxWidth = 160 * kScale, kMaxHeight = 120 * kScale;  // of the region compared, px of the image
constexpr int kMinSide = 16;  // of the reduced region, px: a smaller one shows nothing

// Street scenes, rooms and rendered towns have a correlation of at most 0.7 outside the peak at zero shift.
constexpr double kSamePlace = 0.5;   // correlation that bounds the peak at zero shift
constexpr double kSameLooks = 0.85;  // correlation of another place that looks the same

/// The region in the middle of the image, reduced by kScale.
[[nodiscard]] cv::Mat coarse_middle(const cv::Mat& image) {
  const cv::Size size(std::min(image.cols, kMaxWidth), std::min(image.rows, kMaxHeight));
  const cv::Point corner((image.cols - size.width) / 2, (image.rows - size.height) / 2);
  cv::Mat coarse;
  cv::resize(image({corner, size}), coarse,
             {std::max(1, size.width / kScale), std::max(1, size.height / kScale)}, 0.0, 0.0, cv::INTER_AREA);
  return coarse;
}

}  // namespace

bool repeats_itself(const cv::Mat& image) {
  if (image.empty()) return false;
  const cv::Mat scene = coarse_middle(image);
  if (scene.cols < kMinSide || scene.rows < kMinSide) return false;
  const cv::Rect inner(scene.cols / 4, scene.rows / 4, scene.cols / 2, scene.rows / 2);
  cv::Mat correlation;
  cv::matchTemplate(scene, scene(inner), correlation, cv::TM_CCOEFF_NORMED);

  cv::Mat peaks;
  cv::connectedComponents(correlation > kSamePlace, peaks);
  const int no_shift = peaks.at<int>(inner.tl());
  if (no_shift == 0) return false;  // an image without any contrast
  double best = 0.0;
  cv::minMaxLoc(correlation, nullptr, &best, nullptr, nullptr, peaks != no_shift);
  return best > kSameLooks;
}

bool SceneRepetition::repeats_itself(const cv::Mat& keyframe_image, std::size_t keyframe, std::size_t frame) {
  constexpr std::size_t kFramesBetween = 5;
  const bool due = !last_ || (keyframe != last_->keyframe && frame >= last_->frame + kFramesBetween);
  if (due) last_ = {keyframe, frame, stereo_slam::repeats_itself(keyframe_image)};
  return last_->repeats_itself;
}

}  // namespace stereo_slam
