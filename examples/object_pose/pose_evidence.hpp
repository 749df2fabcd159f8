// SPDX-License-Identifier: MIT
#pragma once

#include <numbers>

#include <antipode/distributions/mixture.hpp>
#include <antipode/distributions/projected_gaussian.hpp>

#include "features.hpp"

namespace object_pose {

using Component = antipode::ProjectedGaussian<double>;
using Belief = antipode::Mixture<Component>;

/// The pose given one feature.
struct EvidenceSettings {
  static constexpr double kDegree = std::numbers::pi / 180.0;

  // The surface may be tilted against the line of sight either way: a base element that faces the camera, and
  // six around it. Half of the spread is that on S^3, which has to stay below the gate's 15 degrees.
  double ring_rad = 40.0 * kDegree;
  double tilt_sigma_rad = 18.0 * kDegree;
  // The errors of SIFT on surfaces tilted by up to 55 degrees, measured.
  double roll_sigma_rad = 5.0 * kDegree;
  /// Of the log of a diameter over the one expected for a base element, which stands for many tilts. It tells
  /// how strongly a surface is tilted.
  double log_scale_sigma = 0.15;
  // A feature is not quite where the model has it, in both images alike, and by more if it is large.
  double place_sigma_px = 0.35;
  double place_sigma_per_diameter = 0.03;
  // What the images do not share.
  double stereo_sigma_px = 0.14;
  double stereo_sigma_per_diameter = 0.01;
};

/// The feature's pose T_camera_feature as seven base elements: the place from the stereo measurement, the
/// rotation about the line of sight from SIFT's orientation, the tilt as wide as a feature is visible.
[[nodiscard]] Belief feature_pose(const SeenFeature& seen, double diameter_m, const StereoCamera& camera,
                                  const EvidenceSettings& settings = {});

/// The density of x y for a certain pose y, with exact moments. A lever of decimetres bends the rotation's
/// spread of many degrees into an arc, which the linearised composition takes for its tangent.
[[nodiscard]] Belief compose_with_lever(const Belief& x, const Pose& y);

/// The density of the pose given one feature.
struct FeatureEvidence {
  Belief T_camera_feature;
  Pose T_object_feature;
  Belief T_camera_object;  ///< the feature's pose and the motion from it to the object (MPG Eq. 21, Fig. 3)
};

[[nodiscard]] FeatureEvidence evidence_of(const Match& match, const FeatureModel& model,
                                          const StereoCamera& camera, const EvidenceSettings& settings = {});

}  // namespace object_pose
