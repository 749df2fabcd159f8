// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "stereo_slam/core/types.hpp"

/// Drawing functions shared by the debug images and the live view. Positions are in pixels, colours in
/// OpenCV's order: blue, green, red.
namespace stereo_slam {

inline const cv::Scalar kOrange(0, 140, 255);
inline const cv::Scalar kBlue(255, 170, 60);
inline const cv::Scalar kRed(60, 60, 255);
inline const cv::Scalar kGreen(90, 200, 90);
inline const cv::Scalar kYellow(0, 235, 255);
inline const cv::Scalar kMagenta(255, 80, 255);
inline const cv::Scalar kWhite(235, 235, 235);
inline const cv::Scalar kGrey(120, 120, 120);
inline const cv::Scalar kBackground(24, 24, 24);

/// Green for OK, yellow for WEAK, red for LOST, blue for RELOCALISED, grey without a map.
[[nodiscard]] cv::Scalar colour_of(TrackingStatus status);

inline constexpr int kSubpixelBits = 4;

/// Pixel position in OpenCV's fixed-point drawing coordinates, with kSubpixelBits fractional bits.
[[nodiscard]] cv::Point subpixel(const Vector2<double>& p);

/// Draws a filled dot.
void draw_dot(cv::Mat& canvas, const Vector2<double>& centre_px, double radius_px, const cv::Scalar& colour);

/// Draws the outline of the ellipse x' C^-1 x = chi2 around the centre; C is the covariance.
void draw_ellipse(cv::Mat& canvas, const Vector2<double>& centre_px, const Matrix2<double>& covariance_px2,
                  double chi2, const cv::Scalar& colour);

struct LegendEntry {
  std::string text;
  cv::Scalar colour;
};

/// One line of text as wide as the image; the text is smaller for narrow images.
[[nodiscard]] cv::Mat draw_legend(const std::vector<LegendEntry>& entries, int width_px);

}  // namespace stereo_slam
