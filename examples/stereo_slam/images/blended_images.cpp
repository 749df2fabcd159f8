// SPDX-License-Identifier: MIT
#include "stereo_slam/images/blended_images.hpp"

#include <cmath>
#include <utility>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "stereo_slam/core/median.hpp"

namespace stereo_slam {
namespace {

constexpr int kPatch_px = 15;

/// The correlation coefficient of the surroundings of two points; zero where there is no contrast.
double correlation(const cv::Mat& image, const cv::Point2f& a, const cv::Point2f& b) {
  const auto patch_at = [&](const cv::Point2f& centre) {
    cv::Mat patch;
    cv::getRectSubPix(image, {kPatch_px, kPatch_px}, centre, patch);
    patch -= cv::mean(patch)[0];
    return patch;
  };
  const cv::Mat first = patch_at(a), second = patch_at(b);
  const double norm = std::sqrt(first.dot(first) * second.dot(second));
  return norm > 0.0 ? first.dot(second) / norm : 0.0;
}

/// The image without what is smooth: without that, surroundings some pixels apart correlate everywhere.
cv::Mat details(const cv::Mat& image) {
  constexpr double kSmooth_px = 2.0;
  cv::Mat values, smooth;
  image.convertTo(values, CV_32F);
  cv::GaussianBlur(values, smooth, {}, kSmooth_px);
  return values - smooth;
}

}  // namespace

void Echo::add(const cv::Mat& image, std::span<const CornerPair> moved) {
  constexpr float kLeast_px = 10.0F;  // of motion: the other distances are 4 px from it, twice the smoothing
  constexpr float kShorter = 0.6F, kLonger = 1.4F;  // other distances, in units of the motion
  const cv::Mat detail = details(image);
  const cv::Rect inside(kPatch_px, kPatch_px, image.cols - 2 * kPatch_px, image.rows - 2 * kPatch_px);
  for (const auto& [now_px, next_px] : moved) {
    for (const float sign : {1.0F, -1.0F}) {
      const cv::Point2f motion_px = sign * (next_px - now_px);
      if (std::hypot(motion_px.x, motion_px.y) < kLeast_px) continue;
      const cv::Point2f farthest_px = now_px + kLonger * motion_px;
      if (!inside.contains(now_px) || !inside.contains(farthest_px)) continue;
      const int row = kSide * static_cast<int>(now_px.y) / image.rows;
      const int column = kSide * static_cast<int>(now_px.x) / image.cols;
      Part& part = parts_.at(static_cast<std::size_t>(kSide * row + column));
      part.sum += correlation(detail, now_px, now_px + motion_px) -
                  0.5 * (correlation(detail, now_px, now_px + kShorter * motion_px) +
                         correlation(detail, now_px, farthest_px));
      ++part.count;
    }
  }
}

double Echo::strength() const {
  constexpr std::size_t kEnoughPoints = 10;
  constexpr std::size_t kEnoughParts = 4;
  std::vector<double> means;
  for (const auto& [sum, count] : parts_) {
    if (count >= kEnoughPoints) means.push_back(sum / static_cast<double>(count));
  }
  return means.size() < kEnoughParts ? 0.0 : median(std::move(means));
}

bool Echo::is_of_two_moments() const {
  constexpr double kClear = 0.1;
  return strength() > kClear;
}

}  // namespace stereo_slam
