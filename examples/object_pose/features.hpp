// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "box_model.hpp"
#include "render.hpp"

namespace object_pose {

/// A SIFT feature of the object. Axes of its frame: x along the gradient that defines SIFT's orientation, z
/// into the box.
struct ModelFeature {
  std::size_t face;  ///< index in BoxModel::faces
  Pose T_object_feature;
  double diameter_m;  ///< of the patch that SIFT describes
};

/// All features of the object.
struct FeatureModel {
  std::vector<ModelFeature> features;
  cv::Mat descriptors;  ///< one row per feature
};

/// A SIFT feature seen in both images.
struct SeenFeature {
  Eigen::Vector3d z;  ///< (u, v, d): column and row in the left image, disparity [px]
  double angle_rad;   ///< direction of the gradient in the left image, from the u axis towards v
  double diameter_px;
};

/// A feature of the model and the seen feature that matches it.
struct Match {
  std::size_t model_feature;  ///< index in FeatureModel::features
  SeenFeature seen;
  double ratio;  ///< descriptor distance over that to the best match elsewhere; small: distinctive
};

/// Which matches are accepted.
struct MatchSettings {
  double max_ratio = 0.75;             ///< see Match::ratio
  double max_row_difference_px = 1.5;  ///< between the images
  double min_depth_m = 0.3;            ///< limits the disparity
  /// Only so many of the most distinctive matches are kept.
  std::size_t max_matches = 40;
};

/// The SIFT features of all faces. Throws std::runtime_error if there are fewer than two.
[[nodiscard]] FeatureModel learn_features(const BoxModel& box);

/// The features of the object that are seen in both images, without those on faces that have few matches. The
/// most distinctive match comes first. Each next one is the match furthest on the object from all before, as
/// nearby features have nearly the same information. Throws std::runtime_error if an image has another size
/// than the camera's, or if there is no match.
[[nodiscard]] std::vector<Match> match_features(const StereoImages& images, const StereoCamera& camera,
                                                const FeatureModel& model,
                                                const MatchSettings& settings = {});

}  // namespace object_pose
