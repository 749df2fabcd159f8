// SPDX-License-Identifier: MIT
#include "stereo_slam/tracking/predict.hpp"

#include <algorithm>
#include <cmath>

#include <antipode/filters/predict.hpp>
#include <antipode/sampling/pose_rules.hpp>

namespace stereo_slam {
namespace {

/// The density without its correlation of orientation and translation.
[[nodiscard]] PoseDensity decoupled(const PoseDensity& density) {
  return PoseDensity::independent(density.orientation(), density.mean_translation(),
                                  density.translation_covariance());
}

/// The covariance of a motion measured by the odometry, with 0.2 mrad and 2 mm in each axis in addition.
[[nodiscard]] Matrix6<double> covariance_with_least_noise(const PoseGaussian& motion) {
  constexpr double kRotation_rad = 2e-4, kTranslation_m = 2e-3;
  Vector6<double> least;
  least << Vector3<double>::Constant(kRotation_rad), Vector3<double>::Constant(kTranslation_m);
  Matrix6<double> covariance = motion.covariance;
  covariance.diagonal() += least.cwiseAbs2();
  return covariance;
}

}  // namespace

PoseGaussian guessed_motion(const ExpectedMotion& expected, const MotionSettings& settings,
                            const UnseenSteps& unseen) {
  // The unknown translation has a constant velocity: its standard deviation grows with the number of steps.
  // That of the rotation grows with the square root.
  const double growth = std::sqrt(unseen.now * (2.0 * unseen.before + unseen.now));
  double rotation_sigma_rad = std::sqrt(unseen.now) * settings.lost_rotation_sigma_rad;
  double translation_sigma_m = growth * settings.lost_translation_sigma_m;
  if (unseen.before == 0.0) {
    rotation_sigma_rad = std::min(rotation_sigma_rad, expected.rotation_sigma_rad);
    translation_sigma_m = std::min(translation_sigma_m, expected.translation_sigma_m);
  }
  Vector6<double> sigma;
  sigma << Vector3<double>::Constant(rotation_sigma_rad), Vector3<double>::Constant(translation_sigma_m);
  return {expected.T_previous_current, sigma.cwiseAbs2().asDiagonal()};
}

PoseGaussian predict_pose(const PoseGaussian& posterior, const PoseGaussian& motion) {
  return antipode::predict_closed_form(posterior, motion.pose, {Pose::identity(), motion.covariance});
}

PoseDensity predict_as_in_paper(const PoseDensity& posterior, const PoseGaussian& motion) {
  const auto noise =
      decoupled(PoseDensity::from_pose_covariance(Pose::identity(), covariance_with_least_noise(motion)));
  return antipode::predict(posterior, motion.pose, noise, antipode::PaperPoseRule{},
                           {.keep_coupling = false});
}

}  // namespace stereo_slam
