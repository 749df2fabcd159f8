// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "stereo_slam/core/types.hpp"
#include "stereo_slam/settings/settings.hpp"

namespace stereo_slam {

/// How far an ORB descriptor reaches in any orientation: points nearer to the image border cannot be
/// described.
inline constexpr int kDescriptorReach_px = 19;

/// Features of both images of a stereo pair.
struct StereoFeatures {
  std::vector<Feature> left;
  std::vector<Feature> right;
};

/// ORB features of one grey image: the strongest of every grid cell, then the second strongest of every cell,
/// and so on, until there are `settings.count`, so that the features cover the image evenly. The last round
/// is completed: the result may have more features. Ordered by cell, then by strength.
[[nodiscard]] std::vector<Feature> extract_features(const cv::Mat& image, const FeatureSettings& settings);

/// Features of both images, extracted in parallel on OpenCV's threads.
[[nodiscard]] StereoFeatures extract_features(const StereoFrame& frame, const FeatureSettings& settings);

/// Positions of the features, px.
[[nodiscard]] std::vector<Vector2<double>> positions(const std::vector<Feature>& features);

/// Features that are at least `radius_px` from all of `used_px`, in their order.
[[nodiscard]] std::vector<Feature> exclude_features(const std::vector<Feature>& features,
                                                    const std::vector<Vector2<double>>& used_px,
                                                    cv::Size image, double radius_px);

/// At most `count` features, spread over square buckets of the image: the strongest of every bucket, then the
/// second strongest of every bucket, and so on.
[[nodiscard]] std::vector<Feature> spread_features(std::vector<Feature> features, cv::Size image,
                                                   int bucket_px, std::size_t count);

}  // namespace stereo_slam
