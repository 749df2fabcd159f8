// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <type_traits>

#include <antipode/detail/products.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/geometry/dual_quaternion.hpp>
#include <antipode/weighted_samples.hpp>

/// Statistical linear regression of a measurement model over sigma points.
namespace antipode::detail {

template <class T>
struct ValueOfOptional : std::type_identity<T> {};
template <class T>
struct ValueOfOptional<std::optional<T>> : std::type_identity<T> {};

/// What a model h(pose, x) measures: its vector, whether it comes in a std::optional or not.
template <class Model, class Scalar, int Dim>
using MeasurementOf = typename ValueOfOptional<
    std::invoke_result_t<const Model&, const DualQuaternion<Scalar>&, const Vector<Scalar, Dim>&>>::type;

/// The samples of the poses; a known pose is one sample.
template <class Scalar>
[[nodiscard]] WeightedSamples<Scalar, 8, 1> pose_samples(const DualQuaternion<Scalar>& pose) {
  return {pose.coeffs(), Vector<Scalar, 1>::Ones()};
}
template <class Scalar, int Count>
[[nodiscard]] const WeightedSamples<Scalar, 8, Count>& pose_samples(
    const WeightedSamples<Scalar, 8, Count>& poses) {
  return poses;
}

/// z = mean + slope g + e for g ~ N(0, I), with e of covariance `residual` and not correlated with g.
template <class Scalar, int Dim, int Measured>
struct LinearModel {
  Vector<Scalar, Measured> mean;
  Matrix<Scalar, Measured, Dim> slope;
  Matrix<Scalar, Measured> residual;  ///< positive semidefinite by construction: a sum of squares

  /// Cov(z).
  [[nodiscard]] Matrix<Scalar, Measured> covariance() const { return slope * slope.transpose() + residual; }
};

/// h at x for every pose, one per column; false if one of the poses has no finite measurement.
template <class Model, class Scalar, int Dim, int Count, int Measured>
[[nodiscard]] bool measure(const Model& h, const WeightedSamples<Scalar, 8, Count>& poses,
                           const Vector<Scalar, Dim>& x, Matrix<Scalar, Measured, Count>& measurements) {
  for (int i = 0; i < Count; ++i) {
    if (poses.weights[i] == Scalar(0)) {
      measurements.col(i).setZero();
      continue;
    }
    const std::optional<Vector<Scalar, Measured>> z =
        h(DualQuaternion<Scalar>::unchecked(poses.points.col(i)), x);
    if (!z || !z->allFinite()) return false;
    measurements.col(i) = *z;
  }
  return true;
}

/// The best linear model of h(pose, x) over all pairs of a pose sample and x = mean + L g_j, {g_j} a rule for
/// N(0, I); nothing if one of the pairs has no finite measurement. The spread over the poses is part of the
/// residual.
template <class Model, class Scalar, int Count, int Dim, int Points>
[[nodiscard]] auto regress(const Model& h, const WeightedSamples<Scalar, 8, Count>& poses,
                           const Vector<Scalar, Dim>& mean, const Matrix<Scalar, Dim>& L,
                           const WeightedSamples<Scalar, Dim, Points>& standard) {
  constexpr int kMeasured = MeasurementOf<Model, Scalar, Dim>::RowsAtCompileTime;
  using Linear = LinearModel<Scalar, Dim, kMeasured>;
  Linear model{.mean = Vector<Scalar, kMeasured>::Zero(),
               .slope = Matrix<Scalar, kMeasured, Dim>::Zero(),
               .residual = Matrix<Scalar, kMeasured>::Zero()};
  Matrix<Scalar, kMeasured, Points> means;
  Matrix<Scalar, kMeasured, Count> measurements;
  for (int j = 0; j < Points; ++j) {
    means.col(j).setZero();
    if (standard.weights[j] == Scalar(0)) continue;
    const Vector<Scalar, Dim> x = mean + L * standard.points.col(j);
    if (!measure(h, poses, x, measurements)) return std::optional<Linear>{};
    means.col(j) = measurements * poses.weights;
    model.mean += standard.weights[j] * means.col(j);
    for (int i = 0; i < Count; ++i) {
      const Vector<Scalar, kMeasured> deviation = measurements.col(i) - means.col(j);
      add_outer_product(standard.weights[j] * poses.weights[i], deviation, deviation, model.residual);
    }
  }
  for (int j = 0; j < Points; ++j) {
    add_outer_product<Scalar, kMeasured, Dim>(standard.weights[j], means.col(j) - model.mean,
                                              standard.points.col(j), model.slope);
  }
  for (int j = 0; j < Points; ++j) {
    const Vector<Scalar, kMeasured> error = means.col(j) - model.mean - model.slope * standard.points.col(j);
    add_outer_product(standard.weights[j], error, error, model.residual);
  }
  return std::optional<Linear>{model};
}

/// One measurement over a density: z = mean + A y + e with y ~ N(0, I) and Cov(e) = disturbance.
template <class Scalar, int Dim, int N>
struct LinearMeasurementModel {
  Vector<Scalar, Dim> mean;
  Matrix<Scalar, Dim, N> A;
  Matrix<Scalar, Dim> disturbance;
};

/// The regression of predicted measurements, one per column, on the sigma points of the predictions.
template <class Scalar, int Dim, int N, int Count>
[[nodiscard]] LinearMeasurementModel<Scalar, Dim, N> regress_on_points(
    const Matrix<Scalar, Dim, Count>& predicted, const WeightedSamples<Scalar, N, Count>& standard) {
  using Z = Vector<Scalar, Dim>;
  const Eigen::Index rows = predicted.rows();
  LinearMeasurementModel<Scalar, Dim, N> model{Z::Zero(rows), Matrix<Scalar, Dim, N>::Zero(rows, N),
                                               Matrix<Scalar, Dim>::Zero(rows, rows)};
  for (int k = 0; k < Count; ++k) model.mean += standard.weights[k] * predicted.col(k);
  for (int k = 0; k < Count; ++k) {
    add_outer_product<Scalar, Dim, N>(standard.weights[k], predicted.col(k) - model.mean,
                                      standard.points.col(k), model.A);
  }
  for (int k = 0; k < Count; ++k) {
    const Z error = predicted.col(k) - model.mean - model.A * standard.points.col(k);
    add_outer_product(standard.weights[k], error, error, model.disturbance);
  }
  return model;
}

}  // namespace antipode::detail
