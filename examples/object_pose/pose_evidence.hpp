// SPDX-License-Identifier: MIT
#pragma once

#include <numbers>

#include <antipode/distributions/mixture.hpp>
#include <antipode/distributions/projected_gaussian.hpp>

#include "features.hpp"

namespace object_pose {

/// One component of a belief, a base element of the paper.
using Component = antipode::ProjectedGaussian<double>;
/// A density of poses.
using Belief = antipode::Mixture<Component>;

/// The errors of a single feature, as standard deviations.
struct EvidenceSettings {
  static constexpr double kDegree = std::numbers::pi / 180.0;

  // The tilt of the surface is unknown: one base element faces the camera, and six are tilted by ring_rad
  // around it, each with a standard deviation of tilt_sigma_rad about both axes. On S^3 that is half, which
  // has to stay below the 15 degrees of the gate.
  double ring_rad = 40.0 * kDegree;
  double tilt_sigma_rad = 18.0 * kDegree;
  // Of SIFT's orientation, measured on surfaces tilted by up to 55 degrees.
  double roll_sigma_rad = 5.0 * kDegree;
  /// Of log(diameter / expected diameter). The expected diameter follows from the tilt of a base element,
  /// which stands for many tilts. The diameter therefore tells how strongly a surface is tilted.
  double log_scale_sigma = 0.15;
  // Error of the position in the image that both images share; it grows with the diameter [px].
  double place_sigma_px = 0.35;
  double place_sigma_per_diameter = 0.03;
  // Error of the position that is independent in both images.
  double stereo_sigma_px = 0.14;
  double stereo_sigma_per_diameter = 0.01;
};

/// The feature's pose T_camera_feature as seven base elements. The position is from the stereo measurement,
/// the rotation about the line of sight from SIFT's orientation, and the tilt is as wide as features are
/// visible.
[[nodiscard]] Belief feature_pose(const SeenFeature& seen, double diameter_m, const StereoCamera& camera,
                                  const EvidenceSettings& settings = {});

/// The density of x y for a known pose y, with exact moments (by way of a BinghamGaussian). If a rotation is
/// uncertain by many degrees, a lever arm of decimetres spreads the position along an arc. The linearised
/// composition would replace the arc by its tangent.
[[nodiscard]] Belief compose_with_lever(const Belief& x, const Pose& y);

/// The density of the object's pose given one feature, and what it is composed of.
struct FeatureEvidence {
  Belief T_camera_feature;
  Pose T_object_feature;
  Belief T_camera_object;  ///< the feature's pose and the motion from it to the object (MPG Eq. 21, Fig. 3)
};

/// The evidence of a match, from its stereo measurement and SIFT's orientation and size.
[[nodiscard]] FeatureEvidence evidence_of(const Match& match, const FeatureModel& model,
                                          const StereoCamera& camera, const EvidenceSettings& settings = {});

}  // namespace object_pose
