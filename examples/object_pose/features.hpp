// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "box_model.hpp"
#include "render.hpp"

namespace object_pose {

/// A SIFT feature of the object: x along the gradient that gives it its orientation, z into the box.
struct ModelFeature {
  std::size_t face;
  Pose T_object_feature;
  double diameter_m;
};

struct FeatureModel {
  std::vector<ModelFeature> features;
  cv::Mat descriptors;  ///< a row for each
};

/// The same in both images.
struct SeenFeature {
  Eigen::Vector3d z;  ///< column and row on the left, disparity [px]
  double angle_rad;   ///< of the gradient in the left image, from x to y
  double diameter_px;
};

struct Match {
  std::size_t model_feature;
  SeenFeature seen;
  double ratio;  ///< descriptor distance over that to the next best place: small is distinctive
};

struct MatchSettings {
  double max_ratio = 0.75;
  double max_row_difference_px = 1.5;
  double min_depth_m = 0.3;
  /// Of the matches, the most distinctive ones are kept.
  std::size_t max_matches = 40;
};

/// The features of all faces. Throws std::runtime_error if there are none.
[[nodiscard]] FeatureModel learn_features(const BoxModel& box);

/// Features of the object seen in both images, on faces that have several: first the most distinctive, then
/// always the one that lies furthest on the object from those before, as near ones say the same. Throws
/// std::runtime_error if the images are not the camera's, or without a match.
[[nodiscard]] std::vector<Match> match_features(const StereoImages& images, const StereoCamera& camera,
                                                const FeatureModel& model,
                                                const MatchSettings& settings = {});

}  // namespace object_pose
