// SPDX-License-Identifier: MIT
#include "stereo_slam/frontend/features.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include <opencv2/features2d.hpp>

#include "stereo_slam/core/opencv_points.hpp"
#include "stereo_slam/core/parallel.hpp"
#include "stereo_slam/frontend/spatial_index.hpp"

namespace stereo_slam {
namespace {

constexpr int kPyramidLevels = 4;     // most that an image has
constexpr double kScaleFactor = 1.2;  // between levels of the pyramid
constexpr int kCell_px = 32;          // over which features are spread
constexpr int kFastThreshold = 6;     // grey levels; each cell keeps its strongest corners

constexpr int kPatchSize_px = 31;

// The detector returns many more corners than are kept: the grid chooses among them.
constexpr int kCandidatesPerFeature = 4;

/// Levels of the pyramid that are large enough for a described patch, at least one.
[[nodiscard]] int usable_levels(const cv::Size& image) {
  double side_px = std::min(image.width, image.height);
  int levels = 1;
  while (levels < kPyramidLevels && (side_px /= kScaleFactor) > 2 * kDescriptorReach_px) ++levels;
  return levels;
}

[[nodiscard]] cv::Ptr<cv::ORB> make_orb(const cv::Size& image, const FeatureSettings& settings) {
  return cv::ORB::create(kCandidatesPerFeature * settings.count, static_cast<float>(kScaleFactor),
                         usable_levels(image), kDescriptorReach_px, 0, 2, cv::ORB::HARRIS_SCORE,
                         kPatchSize_px, kFastThreshold);
}

/// Grid cells, each with its candidates ordered by strength.
class FeatureGrid {
 public:
  FeatureGrid(cv::Size image, int cell_px)
      : cell_px_(cell_px),
        columns_((image.width + cell_px - 1) / cell_px),
        cells_(static_cast<std::size_t>(columns_ * ((image.height + cell_px - 1) / cell_px))) {}

  void insert(const cv::KeyPoint& keypoint) {
    const int column = static_cast<int>(keypoint.pt.x) / cell_px_;
    const int row = static_cast<int>(keypoint.pt.y) / cell_px_;
    cells_[static_cast<std::size_t>(row * columns_ + column)].push_back(keypoint);
  }

  /// Takes the strongest of every cell, then the second of every cell, and so on, keeping `min_distance_px`
  /// within a cell: the same corner is found on several pyramid levels.
  [[nodiscard]] std::vector<cv::KeyPoint> spread(std::size_t count, float min_distance_px) {
    for (auto& cell : cells_) thin(cell, min_distance_px);
    std::size_t rank = 0;
    std::size_t taken = 0;
    for (bool any = true; any && taken < count; ++rank) {
      any = false;
      for (const auto& cell : cells_) {
        if (rank >= cell.size()) continue;
        any = true;
        ++taken;
      }
    }
    std::vector<cv::KeyPoint> result;
    result.reserve(taken);
    for (const auto& cell : cells_) {
      result.insert(result.end(), cell.begin(),
                    cell.begin() + static_cast<std::ptrdiff_t>(std::min(rank, cell.size())));
    }
    return result;
  }

 private:
  static void thin(std::vector<cv::KeyPoint>& cell, float min_distance_px) {
    std::sort(cell.begin(), cell.end(), [](const cv::KeyPoint& a, const cv::KeyPoint& b) {
      if (a.response != b.response) return a.response > b.response;
      return std::pair(a.pt.y, a.pt.x) < std::pair(b.pt.y, b.pt.x);
    });
    std::vector<cv::KeyPoint> kept;
    for (const auto& candidate : cell) {
      const bool crowded = std::any_of(kept.begin(), kept.end(), [&](const cv::KeyPoint& k) {
        return std::abs(k.pt.x - candidate.pt.x) < min_distance_px &&
               std::abs(k.pt.y - candidate.pt.y) < min_distance_px;
      });
      if (!crowded) kept.push_back(candidate);
    }
    cell = std::move(kept);
  }

  int cell_px_;
  int columns_;
  std::vector<std::vector<cv::KeyPoint>> cells_;
};

[[nodiscard]] Feature to_feature(const cv::KeyPoint& keypoint, const cv::Mat& descriptor) {
  Feature feature;
  feature.position_px = to_eigen(keypoint.pt);
  feature.response = static_cast<double>(keypoint.response);
  std::memcpy(feature.descriptor.data(), descriptor.ptr(), feature.descriptor.size());
  return feature;
}

}  // namespace

std::vector<Feature> extract_features(const cv::Mat& image, const FeatureSettings& settings) {
  constexpr float kMinDistance_px = 3.0F;
  const auto orb = make_orb(image.size(), settings);
  std::vector<cv::KeyPoint> candidates;
  orb->detect(image, candidates);

  FeatureGrid grid(image.size(), kCell_px);
  for (const auto& candidate : candidates) grid.insert(candidate);
  auto keypoints = grid.spread(static_cast<std::size_t>(settings.count), kMinDistance_px);

  cv::Mat descriptors;
  orb->compute(image, keypoints, descriptors);
  std::vector<Feature> features;
  features.reserve(keypoints.size());
  for (std::size_t i = 0; i < keypoints.size(); ++i) {
    features.push_back(to_feature(keypoints[i], descriptors.row(static_cast<int>(i))));
  }
  return features;
}

StereoFeatures extract_features(const StereoFrame& frame, const FeatureSettings& settings) {
  StereoFeatures features;
  run_both([&] { features.left = extract_features(frame.left, settings); },
           [&] { features.right = extract_features(frame.right, settings); });
  return features;
}

std::vector<Vector2<double>> positions(const std::vector<Feature>& features) {
  std::vector<Vector2<double>> result;
  result.reserve(features.size());
  for (const auto& feature : features) result.push_back(feature.position_px);
  return result;
}

std::vector<Feature> exclude_features(const std::vector<Feature>& features,
                                      const std::vector<Vector2<double>>& used_px, cv::Size image,
                                      double radius_px) {
  const SpatialIndex used(used_px, image);
  std::vector<Feature> result;
  std::copy_if(features.begin(), features.end(), std::back_inserter(result),
               [&](const Feature& feature) { return !used.any_within(feature.position_px, radius_px); });
  return result;
}

std::vector<Feature> spread_features(std::vector<Feature> features, cv::Size image, int bucket_px,
                                     std::size_t count) {
  std::stable_sort(features.begin(), features.end(),
                   [](const Feature& a, const Feature& b) { return a.response > b.response; });
  std::vector<Feature> result;
  for (const std::size_t i : spread_over_buckets(positions(features), image, bucket_px, count)) {
    result.push_back(features[i]);
  }
  return result;
}

}  // namespace stereo_slam
