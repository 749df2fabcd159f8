// SPDX-License-Identifier: MIT
#include "stereo_slam/frontend/fast_corners.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <opencv2/core/hal/intrin.hpp>
#include <opencv2/features2d.hpp>

#include "stereo_slam/frontend/features.hpp"

namespace stereo_slam {

cv::Rect corner_area(cv::Size image) {
  return {kDescriptorReach_px, kDescriptorReach_px, std::max(0, image.width - 2 * kDescriptorReach_px),
          std::max(0, image.height - 2 * kDescriptorReach_px)};
}

std::vector<cv::KeyPoint> fast_corners(const cv::Mat& image, const cv::Rect& part, int threshold) {
  // FAST skips a border of three pixels, and non-maximum suppression needs one more.
  constexpr int kMargin_px = 4;
  const cv::Point corner = part.tl() - cv::Point(kMargin_px, kMargin_px);
  const cv::Rect with_margin(corner, part.size() + cv::Size(2 * kMargin_px, 2 * kMargin_px));
  std::vector<cv::KeyPoint> keypoints;
  cv::FAST(image(with_margin), keypoints, threshold, /*nonmaxSuppression=*/true);
  for (auto& keypoint : keypoints) keypoint.pt += cv::Point2f(corner);
  std::erase_if(keypoints, [&](const cv::KeyPoint& k) { return !part.contains(cv::Point(k.pt)); });
  return keypoints;
}

double smallest_eigenvalue(const cv::Mat& image, cv::Point centre) {
  constexpr int kTensorRadius_px = 3;
  static_assert(kTensorRadius_px == 3, "a row has seven pixels, one less than a register");
  const cv::v_int16x8 in_row(1, 1, 1, 1, 1, 1, 1, 0);
  const auto pixels = [](const std::uint8_t* p) { return cv::v_reinterpret_as_s16(cv::v_load_expand(p)); };
  cv::v_int32x4 xx = cv::v_setzero_s32();
  cv::v_int32x4 xy = cv::v_setzero_s32();
  cv::v_int32x4 yy = cv::v_setzero_s32();
  for (int row = centre.y - kTensorRadius_px; row <= centre.y + kTensorRadius_px; ++row) {
    const std::uint8_t* line = image.ptr<std::uint8_t>(row) + centre.x - kTensorRadius_px;
    // Functions, not operators, which OpenCV 4.11 no longer has for these types.
    const auto dx = cv::v_sub_wrap(pixels(line + 1), pixels(line - 1));
    const auto dy = cv::v_sub_wrap(pixels(line + image.step), pixels(line - image.step));
    const auto dx_in_row = cv::v_mul_wrap(dx, in_row);
    xx = cv::v_dotprod(dx_in_row, dx, xx);
    xy = cv::v_dotprod(dx_in_row, dy, xy);
    yy = cv::v_dotprod(cv::v_mul_wrap(dy, in_row), dy, yy);
  }
  const double sum_xx = cv::v_reduce_sum(xx);
  const double sum_yy = cv::v_reduce_sum(yy);
  const double half_trace = 0.125 * (sum_xx + sum_yy);  // dx and dy are twice the gradient: a factor of 1/4
  const double half_difference = 0.125 * (sum_xx - sum_yy);
  const double off_diagonal = 0.25 * cv::v_reduce_sum(xy);
  return half_trace - std::sqrt(half_difference * half_difference + off_diagonal * off_diagonal);
}

}  // namespace stereo_slam
