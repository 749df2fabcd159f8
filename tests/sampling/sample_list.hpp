// SPDX-License-Identifier: MIT
#pragma once

#include <antipode/eigen_types.hpp>
#include <antipode/weighted_samples.hpp>

namespace antipode::test {

/// Samples in double, whatever their scalar, dimension and number: what checks them compiles once.
struct SampleList {
  Eigen::MatrixXd points;
  Eigen::VectorXd weights;

  template <class Scalar, int Dim, int Count>
  explicit SampleList(const WeightedSamples<Scalar, Dim, Count>& samples)
      : points(Dim, Count), weights(Count) {
    for (int k = 0; k < Count; ++k) {
      for (int i = 0; i < Dim; ++i) points(i, k) = static_cast<double>(samples.points(i, k));
      weights[k] = static_cast<double>(samples.weights[k]);
    }
  }

  /// sum_k w_k x_k.
  [[nodiscard]] Eigen::VectorXd mean() const {
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(points.rows());
    for (Eigen::Index k = 0; k < points.cols(); ++k) sum += weights[k] * points.col(k);
    return sum;
  }

  /// sum_k w_k (x_k - c) (x_k - c)^T.
  [[nodiscard]] Eigen::MatrixXd second_moments(const Eigen::VectorXd& c) const {
    Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(points.rows(), points.rows());
    for (Eigen::Index k = 0; k < points.cols(); ++k) {
      const Eigen::VectorXd x = points.col(k) - c;
      for (Eigen::Index j = 0; j < sum.cols(); ++j) sum.col(j) += weights[k] * x[j] * x;
    }
    return sum;
  }
  [[nodiscard]] Eigen::MatrixXd second_moments() const {
    return second_moments(Eigen::VectorXd::Zero(points.rows()));
  }

  /// The same points with their coordinates squared; its second moments are fourth moments of these.
  [[nodiscard]] SampleList squares() const {
    SampleList result = *this;
    for (double& entry : result.points.reshaped()) entry *= entry;
    return result;
  }
};

}  // namespace antipode::test
