// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdio>
#include <functional>
#include <limits>
#include <string_view>
#include <vector>

#include <Eigen/Cholesky>

#include <antipode/distributions/bingham_gaussian.hpp>
#include <antipode/distributions/pose_gaussian_queries.hpp>
#include <antipode/filters/pose_filter.hpp>

#include "stereo_world.hpp"

/// One measurement of a single sensor under a wide prior of the pose: rotation and position drawn apart.
namespace consistency {

using antipode::SplitPoseGaussian;
using antipode::UpdateStatus;

/// h and its Jacobian in the split chart, of up to three numbers with independent errors.
struct Sensor {
  const char* name;
  int dim;
  std::function<Vector3<double>(const Pose&, Eigen::Matrix<double, 3, 6>&)> h;
  double sigma;
};

[[nodiscard]] inline Sensor altimeter() {
  return {"altimeter, 10 cm", 1,
          [](const Pose& x, Eigen::Matrix<double, 3, 6>& J) {
            J.setZero();
            J(0, 5) = 1.0;
            return Vector3<double>(x.translation()[2], 0, 0);
          },
          0.1};
}

[[nodiscard]] inline Sensor gps() {
  return {"GPS, 10 cm, 1.2 m from the body", 3,
          [](const Pose& x, Eigen::Matrix<double, 3, 6>& J) {
            const Vector3<double> antenna(1, 0.5, -0.3);
            J << -x.rotation_matrix() * antipode::skew(antenna), Matrix3<double>::Identity();
            return Vector3<double>(x * antenna);
          },
          0.1};
}

[[nodiscard]] inline Sensor range(const char* name, const Vector3<double>& beacon, double sigma) {
  return {name, 1,
          [=](const Pose& x, Eigen::Matrix<double, 3, 6>& J) {
            const Vector3<double> away = x.translation() - beacon;
            J.setZero();
            J.block<1, 3>(0, 3) = away.transpose() / away.norm();
            return Vector3<double>(away.norm(), 0, 0);
          },
          sigma};
}

[[nodiscard]] inline Sensor bearing(const char* name, const Vector3<double>& landmark, double sigma) {
  return {name, 3,
          [=](const Pose& x, Eigen::Matrix<double, 3, 6>& J) {
            const Vector3<double> p = x.inverse() * landmark;
            const Vector3<double> n = p.normalized();
            const Matrix3<double> along = (Matrix3<double>::Identity() - n * n.transpose()) / p.norm();
            J << along * antipode::skew(p), -along * x.rotation_matrix().transpose();
            return n;
          },
          sigma};
}

/// Position along an axis, measured to be at one of two places, +- z.
[[nodiscard]] inline Sensor two_places(const char* name, double sigma) {
  return {name, 1,
          [](const Pose& x, Eigen::Matrix<double, 3, 6>& J) {
            J.setZero();
            J(0, 3) = x.translation()[0] > 0.0 ? 1.0 : -1.0;
            return Vector3<double>(std::abs(x.translation()[0]), 0, 0);
          },
          sigma};
}

/// Infinite where the density collapsed.
template <class Chart>
[[nodiscard]] double nees_or_infinity(const PoseGaussian<double, Chart>& density, const Pose& truth) {
  const Eigen::LLT<Matrix6<double>> root(density.covariance);
  if (root.info() != Eigen::Success) return std::numeric_limits<double>::infinity();
  return root.matrixL().solve(Chart::local(density.pose, truth)).squaredNorm();
}

/// The NEES of an update over the trials, by its status.
class StatusStatistics {
 public:
  void add(UpdateStatus status, double nees) {
    if (status == UpdateStatus::kConverged) {
      ++converged_;
      converged_nees_ += nees;
      large_ += nees > 30.0;
    } else if (status == UpdateStatus::kNotGaussian) {
      ++not_gaussian_;
      not_gaussian_nees_ += nees;
    } else {
      ++failed_;
    }
  }
  void print(const Sensor& sensor, const char* prior, const char* update) const {
    const auto mean = [](double sum, int count) { return count > 0 ? sum / count : 0.0; };
    std::printf("| %s | %s | %s | %d | %.3g | %d | %d | %.3g | %d |\n", sensor.name, prior, update,
                converged_, mean(converged_nees_, converged_), large_, not_gaussian_,
                mean(not_gaussian_nees_, not_gaussian_), failed_);
  }

 private:
  int converged_ = 0, not_gaussian_ = 0, failed_ = 0, large_ = 0;
  double converged_nees_ = 0.0, not_gaussian_nees_ = 0.0;
};

/// How many trials, and the seed of the first; that of the next is larger by one.
struct Trials {
  unsigned count = 300;
  unsigned first_seed = 0;
};

template <int Dim>
void study_sensor(const Sensor& sensor, const char* prior_name, double rotation_sigma_rad,
                  double translation_sigma_m, const Trials& trials) {
  constexpr std::array kUpdates{"quadratic, screw chart", "quadratic, split chart", "linearised, split chart",
                                "Gauss-Newton, split chart", "reweighting (15 x 15)"};
  std::array<StatusStatistics, kUpdates.size()> statistics;
  const auto predict_with = [&](const Pose& x, std::size_t, Eigen::Matrix<double, Dim, 6>& J_out) {
    Eigen::Matrix<double, 3, 6> J;
    const Eigen::Matrix<double, Dim, 1> z = sensor.h(x, J).template head<Dim>();
    J_out = J.template topRows<Dim>();
    return z;
  };
  const auto predict = [&](const Pose& x, std::size_t i) {
    Eigen::Matrix<double, Dim, 6> J;
    return predict_with(x, i, J);
  };
  for (unsigned trial = 0; trial < trials.count; ++trial) {
    Rng rng(trials.first_seed + trial);
    const SplitPoseGaussian<double> prior{Pose::exp(draw_gaussian<6>(rng, isotropic_covariance(1.0, 2.0))),
                                          isotropic_covariance(rotation_sigma_rad, translation_sigma_m)};
    const Pose truth = antipode::sample(prior, rng);
    const Eigen::Matrix<double, Dim, Dim> R =
        sensor.sigma * sensor.sigma * Eigen::Matrix<double, Dim, Dim>::Identity();
    const std::vector<antipode::NoisyMeasurement<double, Dim>> z{
        {Eigen::Matrix<double, Dim, 1>(predict(truth, 0) + draw_gaussian<Dim>(rng, R)), R}};
    const antipode::GaussianMeasurements measurement(z, predict);
    const auto add = [&](std::size_t i, const auto& posterior, UpdateStatus status) {
      statistics[i].add(status, nees_or_infinity(posterior, truth));
    };
    const auto screw = antipode::in_chart<antipode::ScrewChart<double>>(prior);
    const auto by_screw = antipode::quadratic_update(screw, measurement);
    add(0, by_screw.posterior, by_screw.status);
    const auto quadratic = antipode::quadratic_update(prior, measurement);
    add(1, quadratic.posterior, quadratic.status);
    const auto linearized = antipode::linearized_update(prior, z, predict, {}, antipode::MysovskikhRule<6>{});
    add(2, linearized.posterior, linearized.status);
    const auto newton = antipode::gauss_newton_update(prior, z, predict_with);
    add(3, newton.posterior, newton.status);
    const auto reweighted = antipode::progressive_update(antipode::to_bingham_gaussian(prior), measurement,
                                                         antipode::RichPoseRule{}, {.max_steps = 300});
    add(4, antipode::to_split_pose_gaussian(reweighted.posterior), reweighted.status);
  }
  for (std::size_t i = 0; i < kUpdates.size(); ++i) statistics[i].print(sensor, prior_name, kUpdates[i]);
}

/// Prints a Markdown table of the sensors whose names contain `name`.
inline void study_sensors(const Trials& trials, std::string_view name) {
  constexpr double kDegree = M_PI / 180.0;
  const Vector3<double> beacon(30, 10, 5), landmark(20, -15, 25);
  const std::array sensors{altimeter(),
                           gps(),
                           range("range, 322 m, 50 cm", 10.0 * beacon, 0.5),
                           range("range, 32 m, 5 cm", beacon, 0.05),
                           bearing("bearing, 350 m, 0.6 deg", 10.0 * landmark, 0.01),
                           bearing("bearing, 35 m, 0.6 deg", landmark, 0.01),
                           two_places("one of two places, 50 cm", 0.5),
                           two_places("one of two places, 3 cm", 0.03)};
  struct Prior {
    const char* name;
    double rotation_deg, translation_m;
  };
  const Prior priors[] = {
      {"5 deg, 10 m", 5, 10}, {"10 deg, 2 m", 10, 2}, {"10 deg, 10 m", 10, 10}, {"10 deg, 100 m", 10, 100}};
  std::printf(
      "| measurement | prior | update | converged | their ANEES | of these NEES > 30 | not Gaussian | their "
      "ANEES | failed |\n|---|---|---|---|---|---|---|---|---|\n");
  for (const Prior& prior : priors) {
    for (const Sensor& sensor : sensors) {
      if (std::string_view(sensor.name).find(name) == std::string_view::npos) continue;
      const auto study = sensor.dim == 1 ? study_sensor<1> : study_sensor<3>;
      study(sensor, prior.name, prior.rotation_deg * kDegree, prior.translation_m, trials);
    }
  }
}

}  // namespace consistency
