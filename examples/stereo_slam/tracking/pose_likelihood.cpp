// SPDX-License-Identifier: MIT
#include "stereo_slam/tracking/pose_likelihood.hpp"

#include <algorithm>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "stereo_slam/local_map/landmark_projection.hpp"

namespace stereo_slam {

PoseLikelihood::PoseLikelihood(std::span<const Match> matches, const MapView& map, double cap)
    : camera_(map.camera), cap_(cap) {
  const auto count = static_cast<Eigen::Index>(matches.size());
  points_.resize(4, count);
  measurements_.resize(3, count);
  whitening_.resize(6, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Match& match = matches[static_cast<std::size_t>(i)];
    const Landmark& landmark = map.landmarks[match.landmark];
    const HomogeneousPoint point = to_point(landmark, landmark.mean, camera_);
    points_.col(i) << point.x, point.w;
    measurements_.col(i) = match.z;
    const Matrix3<double> S = match.predicted.landmark_part + match.R;
    const Matrix3<double> U = S.inverse().llt().matrixU();
    whitening_.col(i) << U(0, 0), U(0, 1), U(0, 2), U(1, 1), U(1, 2), U(2, 2);
  }
}

PoseLikelihood::PoseLikelihood(std::span<const Match> matches, const MapView& map, double cap,
                               const PoseGaussian& prior)
    : PoseLikelihood(matches, map, cap) {
  const auto is_independent = [&](const Match& match) {
    return map.landmarks[match.landmark].pose_cross_covariance.isZero(0.0);
  };
  if (std::all_of(matches.begin(), matches.end(), is_independent)) return;
  const Eigen::LLT<Matrix6<double>> root(prior.covariance);
  if (root.info() != Eigen::Success) return;
  prior_ = prior.pose;
  prior_whitening_ = root.matrixL().solve(Matrix6<double>(Matrix6<double>::Identity()));
  correlation_.resize(18, points_.cols());
  Matrix6<double> remaining = Matrix6<double>::Identity();
  for (Eigen::Index i = 0; i < points_.cols(); ++i) {
    const Landmark& landmark = map.landmarks[matches[static_cast<std::size_t>(i)].landmark];
    Matrix3<double> U = Matrix3<double>::Zero();
    U.row(0) = whitening_.col(i).head<3>();
    U.row(1).tail<2>() = whitening_.col(i).segment<2>(3);
    U(2, 2) = whitening_(5, i);
    const Eigen::Matrix<double, 3, 6, Eigen::RowMajor> UV =
        U * landmark_jacobian(landmark, prior.pose, camera_) * landmark.pose_cross_covariance.transpose() *
        prior_whitening_.transpose();
    remaining -= UV.transpose() * UV;
    correlation_.col(i) = UV.reshaped<Eigen::RowMajor>();
  }
  // Not positive definite by rounding, or where first order is not enough: independence is the safer model.
  const Eigen::LLT<Matrix6<double>> factor(remaining);
  correlated_ = factor.info() == Eigen::Success;
  if (correlated_) shared_ = factor.solve(Matrix6<double>::Identity());
}

template <bool Correlated>
double PoseLikelihood::sum_distances(const Pose& T, const Vector6<double>& y, Vector6<double>& w) const {
  const Matrix3<double> R = T.rotation_matrix().transpose();
  const Vector3<double> t = -R * T.translation();
  const double bf = camera_.fx * camera_.baseline_m;
  double sum = 0.0;
  for (Eigen::Index i = 0; i < points_.cols(); ++i) {
    const auto p = points_.col(i);
    const double hx = R(0, 0) * p[0] + R(0, 1) * p[1] + R(0, 2) * p[2] + t.x() * p[3];
    const double hy = R(1, 0) * p[0] + R(1, 1) * p[1] + R(1, 2) * p[2] + t.y() * p[3];
    const double hz = R(2, 0) * p[0] + R(2, 1) * p[1] + R(2, 2) * p[2] + t.z() * p[3];
    const double inverse = 1.0 / hz;
    const double du = measurements_(0, i) - (camera_.fx * hx * inverse + camera_.cx);
    const double dv = measurements_(1, i) - (camera_.fy * hy * inverse + camera_.cy);
    const double dd = measurements_(2, i) - bf * p[3] * inverse;
    const auto U = whitening_.col(i);
    double a = U[0] * du + U[1] * dv + U[2] * dd;
    double b = U[3] * dv + U[4] * dd;
    double c = U[5] * dd;
    if constexpr (Correlated) {
      const auto V = correlation_.col(i);
      for (int k = 0; k < 6; ++k) {
        a -= V[k] * y[k];
        b -= V[6 + k] * y[k];
        c -= V[12 + k] * y[k];
      }
    }
    const double distance2 = a * a + b * b + c * c;
    const bool counts = hz > StereoCamera::kMinDepth_m * p[3] && distance2 < cap_;
    sum += counts ? distance2 : cap_;
    if constexpr (Correlated) {
      if (!counts) continue;
      const auto V = correlation_.col(i);
      for (int k = 0; k < 6; ++k) w[k] += V[k] * a + V[6 + k] * b + V[12 + k] * c;
    }
  }
  return sum;
}

double PoseLikelihood::evaluate(const antipode::Vector8<double>& pose) const {
  const Pose T = Pose::unchecked(pose);
  Vector6<double> w = Vector6<double>::Zero();
  if (!correlated_) return -0.5 * sum_distances<false>(T, w, w);
  const Vector6<double> y = prior_whitening_ * T.boxminus(prior_);
  const double sum = sum_distances<true>(T, y, w);
  return -0.5 * (sum + w.dot(shared_ * w));
}

}  // namespace stereo_slam
