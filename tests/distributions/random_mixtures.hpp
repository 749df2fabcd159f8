// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <utility>
#include <vector>

#include <antipode/detail/products.hpp>
#include <antipode/distributions/mixture.hpp>

#include "distributions/random_projected_gaussians.hpp"

namespace antipode::test {

using PoseComponent = ProjectedGaussian<double>;
using PoseMixture = Mixture<PoseComponent>;

/// How the components of a random mixture lie around a pose, and how wide they are.
struct Spread {
  double angle = 0.1, distance = 0.2;  // of the modes from the pose [rad, m]
  double sigma_u = 0.03, sigma_t = 0.1;
};

template <class Component = PoseComponent, class Scalar = typename Component::Scalar>
[[nodiscard]] Mixture<Component> random_mixture(Rng& rng, int components, const DualQuaternion<Scalar>& pose,
                                                const Spread& spread = {}) {
  std::vector<typename Mixture<Component>::Element> elements;
  for (int i = 0; i < components; ++i) {
    const auto mode = nearby_pose(rng, pose, uniform<double>(rng, 0.0, spread.angle), spread.distance);
    elements.push_back({uniform<Scalar>(rng, 0.2, 1.0),
                        random_density_at<Component>(rng, mode, spread.sigma_u, spread.sigma_t)});
  }
  return Mixture<Component>::normalized(std::move(elements));
}

/// Weighted mean and covariance of vectors, and the standard errors of both.
class SampleMoments {
 public:
  void add(double weight, const Vector6<double>& y) {
    weights_ += weight;
    mean_ += weight * y;
    squared_weights_ += weight * weight;
    detail::add_outer_product(weight, y, y, squares_);
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j < 6; ++j) {
        fourth_(i, j) += weight * weight * y[i] * y[i] * y[j] * y[j];
        second_(i, j) += weight * weight * y[i] * y[j];
      }
    }
  }

  [[nodiscard]] Vector6<double> mean() const { return mean_ / weights_; }
  [[nodiscard]] Matrix6<double> covariance() const {
    return squares_ / weights_ - mean() * mean().transpose();
  }
  /// Of vectors given relative to about their mean.
  [[nodiscard]] Vector6<double> mean_error() const { return second_.diagonal().cwiseSqrt() / weights_; }
  [[nodiscard]] Matrix6<double> covariance_error() const { return fourth_.cwiseSqrt() / weights_; }

 private:
  double weights_ = 0.0, squared_weights_ = 0.0;
  Vector6<double> mean_ = Vector6<double>::Zero();
  Matrix6<double> squares_ = Matrix6<double>::Zero(), second_ = Matrix6<double>::Zero(),
                  fourth_ = Matrix6<double>::Zero();
};

/// Mean and covariance of a mixture in the tangent space of q, its components linearised there.
[[nodiscard]] inline detail::TangentGaussian<double> tangent_moments(const PoseMixture& x,
                                                                     const Vector4<double>& q) {
  detail::TangentGaussian<double> moments{Vector6<double>::Zero(), Matrix6<double>::Zero()};
  for (const auto& [weight, density] : x) {
    const auto y = density.rebased(q);
    moments.mean += weight * y.mean();
    moments.covariance += weight * (y.covariance() + y.mean() * y.mean().transpose());
  }
  moments.covariance -= moments.mean * moments.mean.transpose();
  return moments;
}

}  // namespace antipode::test
