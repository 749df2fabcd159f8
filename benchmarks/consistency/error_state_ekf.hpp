// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include <antipode/distributions/pose_gaussian.hpp>
#include <antipode/filters/gaussian_measurements.hpp>

namespace consistency {

/// What one would write without the library: the textbook filter of the error xi, x = mean exp(xi), with the
/// analytic Jacobian of the measurement, linearised once at the predicted pose.
class ErrorStateEkf {
 public:
  using Belief = antipode::PoseGaussian<double>;

  explicit ErrorStateEkf(const Belief& belief) : belief_(belief) {}

  [[nodiscard]] const Belief& belief() const { return belief_; }

  void predict(const antipode::DualQuaternion<double>& motion, const Belief& noise) {
    const antipode::Matrix6<double> A = motion.inverse().adjoint();
    belief_.pose = (belief_.pose * motion).renormalized();
    belief_.covariance = A * belief_.covariance * A.transpose() + noise.covariance;
  }

  /// Jacobian(pose, i) is dh_i/dxi.
  template <int Dim, class Model, class Jacobian>
  void update(const antipode::GaussianMeasurements<double, Dim, Model>& all, const Jacobian& jacobian) {
    antipode::Matrix6<double> information = belief_.covariance.inverse();
    antipode::Vector6<double> slope = antipode::Vector6<double>::Zero();
    for (std::size_t i = 0; i < all.measurements().size(); ++i) {
      const auto predicted = all.model()(belief_.pose, i);
      if (!predicted) continue;
      const Eigen::Matrix<double, Dim, 6> H = jacobian(belief_.pose, i);
      const Eigen::Matrix<double, 6, Dim> weighted = all.measurements()[i].R.llt().solve(H).transpose();
      information += weighted * H;
      slope += weighted * (all.measurements()[i].z - *predicted);
    }
    belief_.covariance = information.inverse();
    belief_.pose = belief_.pose.boxplus(belief_.covariance * slope).renormalized();
  }

 private:
  Belief belief_;
};

}  // namespace consistency
