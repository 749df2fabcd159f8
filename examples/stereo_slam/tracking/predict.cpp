// SPDX-License-Identifier: MIT
#include "stereo_slam/tracking/predict.hpp"

#include <cmath>

#include <antipode/filters/predict.hpp>
#include <antipode/sampling/pose_rules.hpp>

namespace stereo_slam {
namespace {

constexpr double kMinRotationSigma_rad = 2e-4;   // of a measured motion, per axis
constexpr double kMinTranslationSigma_m = 2e-3;  // of a measured motion, per axis

[[nodiscard]] Matrix6<double> diagonal(double rotation_sigma_rad, double translation_sigma_m) {
  Vector6<double> variance;
  variance << Vector3<double>::Constant(rotation_sigma_rad * rotation_sigma_rad),
      Vector3<double>::Constant(translation_sigma_m * translation_sigma_m);
  return Matrix6<double>(variance.asDiagonal());
}

/// Noise v_k of the prediction.
[[nodiscard]] Matrix6<double> motion_covariance(const PoseGaussian& T_previous_current, bool odometry_valid,
                                                const UnseenSteps& unseen, const MotionSettings& settings) {
  if (!odometry_valid) {
    // The unknown translation has a constant velocity: its standard deviation grows with the number of steps.
    // That of the rotation grows with the square root.
    const double growth = std::sqrt(unseen.now * (2.0 * unseen.before + unseen.now));
    return diagonal(std::sqrt(unseen.now) * settings.lost_rotation_sigma_rad,
                    growth * settings.lost_translation_sigma_m);
  }
  return with_least_noise(T_previous_current).covariance;
}

/// The density without its correlation of orientation and translation.
[[nodiscard]] PoseDensity decoupled(const PoseDensity& density) {
  return PoseDensity::independent(density.orientation(), density.mean_translation(),
                                  density.translation_covariance());
}

}  // namespace

PoseGaussian with_least_noise(PoseGaussian T_previous_current) {
  T_previous_current.covariance += diagonal(kMinRotationSigma_rad, kMinTranslationSigma_m);
  return T_previous_current;
}

PoseDensity predict_pose(const PoseDensity& posterior, const PoseGaussian& T_previous_current,
                         bool odometry_valid, const MotionSettings& settings, const UnseenSteps& unseen) {
  const Matrix6<double> covariance = motion_covariance(T_previous_current, odometry_valid, unseen, settings);
  return antipode::to_bingham_gaussian(antipode::predict_closed_form(
      antipode::to_pose_gaussian(posterior), T_previous_current.pose, {Pose::identity(), covariance}));
}

PoseDensity predict_as_in_paper(const PoseDensity& posterior, const PoseGaussian& T_previous_current,
                                bool odometry_valid, const MotionSettings& settings,
                                const UnseenSteps& unseen) {
  const Matrix6<double> covariance = motion_covariance(T_previous_current, odometry_valid, unseen, settings);
  const auto noise = decoupled(PoseDensity::from_pose_covariance(Pose::identity(), covariance));
  return antipode::predict(posterior, T_previous_current.pose, noise, antipode::PaperPoseRule{},
                           {.keep_coupling = false});
}

}  // namespace stereo_slam
