// SPDX-License-Identifier: MIT
#include "stereo_slam/visualization/drawing.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>
#include <opencv2/imgproc.hpp>

namespace stereo_slam {

cv::Scalar colour_of(TrackingStatus status) {
  switch (status) {
    case TrackingStatus::kInitializing:
      return kGrey;
    case TrackingStatus::kOk:
      return kGreen;
    case TrackingStatus::kWeak:
      return kYellow;
    case TrackingStatus::kLost:
      return kRed;
    case TrackingStatus::kRelocalised:
      return kBlue;
  }
  return kWhite;
}

cv::Point subpixel(const Vector2<double>& p) {
  constexpr double kOne = 1 << kSubpixelBits;
  return {static_cast<int>(std::lround(kOne * p.x())), static_cast<int>(std::lround(kOne * p.y()))};
}

void draw_dot(cv::Mat& canvas, const Vector2<double>& centre_px, double radius_px, const cv::Scalar& colour) {
  cv::circle(canvas, subpixel(centre_px), static_cast<int>(std::lround(radius_px * (1 << kSubpixelBits))),
             colour, cv::FILLED, cv::LINE_AA, kSubpixelBits);
}

void draw_ellipse(cv::Mat& canvas, const Vector2<double>& centre_px, const Matrix2<double>& covariance_px2,
                  double chi2, const cv::Scalar& colour) {
  Eigen::SelfAdjointEigenSolver<Matrix2<double>> axes;
  axes.computeDirect(covariance_px2);
  const Vector2<double> half_axes_px = (chi2 * axes.eigenvalues()).cwiseMax(0.0).cwiseSqrt();
  const Vector2<double> major = axes.eigenvectors().col(1);
  const cv::Point size = subpixel({half_axes_px.y(), half_axes_px.x()});
  cv::ellipse(canvas, subpixel(centre_px), {size.x, size.y}, std::atan2(major.y(), major.x()) * 180.0 / CV_PI,
              0.0, 360.0, colour, 1, cv::LINE_AA, kSubpixelBits);
}

cv::Mat draw_legend(const std::vector<LegendEntry>& entries, int width_px) {
  constexpr int kFont = cv::FONT_HERSHEY_SIMPLEX;
  constexpr double kLargestScale = 0.5;
  constexpr int kGap_px = 18;  // at full scale
  int full_width_px = kGap_px;
  for (const auto& entry : entries) {
    full_width_px += cv::getTextSize(entry.text, kFont, kLargestScale, 1, nullptr).width + kGap_px;
  }
  const double shrink = std::min(1.0, static_cast<double>(width_px) / full_width_px);
  const double scale = kLargestScale * shrink;
  const int height_px = static_cast<int>(std::lround(24.0 * shrink));
  const int baseline_px = static_cast<int>(std::lround(17.0 * shrink));
  const int gap_px = static_cast<int>(kGap_px * shrink);

  cv::Mat line(height_px, width_px, CV_8UC3, kBackground);
  int x = gap_px;
  for (const auto& entry : entries) {
    cv::putText(line, entry.text, {x, baseline_px}, kFont, scale, entry.colour, 1, cv::LINE_AA);
    x += cv::getTextSize(entry.text, kFont, scale, 1, nullptr).width + gap_px;
  }
  return line;
}

}  // namespace stereo_slam
