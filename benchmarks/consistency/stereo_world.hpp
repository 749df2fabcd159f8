// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <random>
#include <vector>

#include <Eigen/Cholesky>

#include <antipode/distributions/pose_gaussian.hpp>

#include "stereo_slam/core/stereo_camera.hpp"
#include "stereo_slam/core/types.hpp"

/// Stereo measurements of points without images: association is known, and the filters know the noise.
namespace consistency {

using antipode::Matrix3;
using antipode::Matrix6;
using antipode::PoseGaussian;
using antipode::Vector3;
using antipode::Vector6;
using stereo_slam::Pose;
using stereo_slam::StereoCamera;

using Rng = std::mt19937_64;

/// The left camera and the baseline of KITTI 00.
[[nodiscard]] inline StereoCamera kitti_camera() {
  return {718.856, 718.856, 607.1928, 185.2157, 0.53715, 1241, 376};
}

[[nodiscard]] inline double uniform(Rng& rng, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(rng);
}

/// N(0, covariance) of any size, for a covariance that may be singular.
template <int Dim>
[[nodiscard]] Eigen::Matrix<double, Dim, 1> draw_gaussian(Rng& rng,
                                                          const Eigen::Matrix<double, Dim, Dim>& covariance) {
  std::normal_distribution<double> normal;
  Eigen::Matrix<double, Dim, 1> g;
  for (double& entry : g) entry = normal(rng);
  const Eigen::LLT<Eigen::Matrix<double, Dim, Dim>> factor(covariance);
  return factor.matrixL() * g;
}

/// Independent rotation and translation errors of the given standard deviations.
[[nodiscard]] inline Matrix6<double> isotropic_covariance(double rotation_sigma_rad,
                                                          double translation_sigma_m) {
  Vector6<double> variance;
  variance << Vector3<double>::Constant(rotation_sigma_rad * rotation_sigma_rad),
      Vector3<double>::Constant(translation_sigma_m * translation_sigma_m);
  return variance.asDiagonal();
}

/// How well a pose is known before an update.
struct PriorWidth {
  const char* name;
  double rotation_sigma_deg;
  double translation_sigma_m;
};

/// A prior of this width somewhere, and a true pose drawn from it.
struct PriorAndTruth {
  PoseGaussian<double> prior;
  Pose truth;

  PriorAndTruth(Rng& rng, const PriorWidth& width)
      : prior{Pose::exp(draw_gaussian<6>(rng, isotropic_covariance(1.0, 5.0))),
              isotropic_covariance(width.rotation_sigma_deg * M_PI / 180.0, width.translation_sigma_m)},
        truth(prior.pose.boxplus(draw_gaussian<6>(rng, prior.covariance))) {}
};

/// Normalised estimation error squared: chi-square with six degrees if the density is consistent.
[[nodiscard]] inline double nees(const PoseGaussian<double>& density, const Pose& truth) {
  const Vector6<double> error = truth.boxminus(density.pose);
  return error.dot(density.covariance.ldlt().solve(error));
}

/// Sums up the errors of one estimator over the runs.
class ErrorStatistics {
 public:
  void add(const PoseGaussian<double>& density, const Pose& truth) {
    const Vector6<double> error = truth.boxminus(density.pose);
    rotation2_ += error.head<3>().squaredNorm();
    translation2_ += (truth.translation() - density.pose.translation()).squaredNorm();
    nees_ += nees(density, truth);
    ++runs_;
  }
  [[nodiscard]] int runs() const { return runs_; }
  [[nodiscard]] double rotation_rmse_deg() const { return std::sqrt(rotation2_ / runs_) * 180.0 / M_PI; }
  [[nodiscard]] double translation_rmse_m() const { return std::sqrt(translation2_ / runs_); }
  [[nodiscard]] double anees() const { return nees_ / runs_; }

 private:
  int runs_ = 0;
  double rotation2_ = 0.0, translation2_ = 0.0, nees_ = 0.0;
};

/// Half the width of the 95 % band of the ANEES about 6.
[[nodiscard]] inline double anees_band(int runs) { return 1.96 * std::sqrt(12.0 / runs); }

}  // namespace consistency
