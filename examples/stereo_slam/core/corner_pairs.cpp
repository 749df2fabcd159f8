// SPDX-License-Identifier: MIT
#include "stereo_slam/core/corner_pairs.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "stereo_slam/core/descriptor.hpp"
#include "stereo_slam/core/parallel.hpp"

namespace stereo_slam {
namespace {

/// Sub-pixel positions of the right corners, by aligning the patches around matched corners, which are
/// detected at whole pixels. Where the alignment fails the detected position is kept.
std::vector<cv::Point2f> align(const cv::Mat& left, const cv::Mat& right,
                               const std::vector<cv::Point2f>& left_px,
                               const std::vector<cv::Point2f>& right_px) {
  constexpr double kMaxShift_px = 2.0;
  const cv::Size window(15, 15);
  auto aligned_px = right_px;
  std::vector<std::uint8_t> found;
  cv::calcOpticalFlowPyrLK(left, right, left_px, aligned_px, found, cv::noArray(), window,
                           /*maxLevel=*/0, {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 30, 0.01},
                           cv::OPTFLOW_USE_INITIAL_FLOW);
  for (std::size_t i = 0; i < aligned_px.size(); ++i) {
    if (found[i] == 0 || cv::norm(aligned_px[i] - right_px[i]) > kMaxShift_px) aligned_px[i] = right_px[i];
  }
  return aligned_px;
}

/// An image without corners, reduced if it is large.
ImageCorners reduced(const cv::Mat& image, double most_pixels) {
  const double factor = std::sqrt(most_pixels / std::max(1.0, static_cast<double>(image.total())));
  ImageCorners result{.image = image, .unit_px = 1.0F, .positions_px = {}, .descriptors = {}};
  if (factor >= 1.0) return result;
  cv::resize(image, result.image, {}, factor, factor, cv::INTER_AREA);
  result.unit_px = static_cast<float>(1.0 / factor);
  return result;
}

}  // namespace

RobustLine line_of_rows(std::span<const CornerPair> pairs, double least_scale_px) {
  std::vector<Vector2<double>> rows;
  rows.reserve(pairs.size());
  for (const auto& [left_px, right_px] : pairs)
    rows.emplace_back(static_cast<double>(right_px.x), static_cast<double>(left_px.y - right_px.y));
  return fit_line(rows, {}, least_scale_px);
}

ImageCorners find_corners(const cv::Mat& image, double most_pixels) {
  constexpr int kFeatures = 1000;
  constexpr int kLevels = 2;  // coarser levels locate a corner no better than two pixels
  std::vector<cv::KeyPoint> points;
  cv::Mat rows;
  ImageCorners features = reduced(image, most_pixels);
  cv::ORB::create(kFeatures, 1.2F, kLevels)->detectAndCompute(features.image, cv::noArray(), points, rows);
  cv::KeyPoint::convert(points, features.positions_px);
  features.descriptors.resize(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::uint8_t* row = rows.ptr(static_cast<int>(i));
    std::copy_n(row, features.descriptors[i].size(), features.descriptors[i].begin());
  }
  return features;
}

std::vector<CornerPair> match_corners(const ImageCorners& left, const ImageCorners& right) {
  constexpr int kMaxHamming = 40;
  std::vector<NearestDescriptor> of_left(left.descriptors.size());
  std::vector<NearestDescriptor> of_right(right.descriptors.size());
  for (std::size_t i = 0; i < of_left.size(); ++i) {
    for (std::size_t j = 0; j < of_right.size(); ++j) {
      const int distance = hamming_distance(left.descriptors[i], right.descriptors[j]);
      of_left[i].offer(j, distance);
      of_right[j].offer(i, distance);
    }
  }
  std::vector<cv::Point2f> left_px;
  std::vector<cv::Point2f> right_px;
  for (std::size_t i = 0; i < of_left.size(); ++i) {
    const auto& [j, distance, second] = of_left[i];
    if (distance > kMaxHamming || of_right[j].index != i) continue;
    left_px.push_back(left.positions_px[i]);
    right_px.push_back(right.positions_px[j]);
  }
  std::vector<CornerPair> pairs;
  if (left_px.empty()) return pairs;
  const auto aligned_px = align(left.image, right.image, left_px, right_px);
  for (std::size_t i = 0; i < left_px.size(); ++i)
    pairs.push_back({left.unit_px * left_px[i], right.unit_px * aligned_px[i]});
  return pairs;
}

std::vector<CornerPair> match_corners(const cv::Mat& left_image, const cv::Mat& right_image) {
  ImageCorners left, right;
  run_both([&] { left = find_corners(left_image); }, [&] { right = find_corners(right_image); });
  return match_corners(left, right);
}

}  // namespace stereo_slam
