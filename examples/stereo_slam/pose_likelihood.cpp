// SPDX-License-Identifier: MIT
#include "pose_likelihood.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>

namespace stereo_slam {

PoseLikelihood::PoseLikelihood(std::span<const Match> matches, const std::vector<Landmark>& landmarks,
                               const StereoCamera& camera, double cap)
    : camera_(camera), cap_(cap) {
  const auto count = static_cast<Eigen::Index>(matches.size());
  points_.resize(4, count);
  measurements_.resize(3, count);
  whitening_.resize(6, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Match& match = matches[static_cast<std::size_t>(i)];
    const Landmark& landmark = landmarks[match.landmark];
    const HomogeneousPoint point = to_point(landmark, landmark.mean, camera);
    points_.col(i) << point.x, point.w;
    measurements_.col(i) = match.z;
    const Matrix3<double> S = match.predicted.landmark_part + match.R;
    const Matrix3<double> U = S.inverse().llt().matrixU();
    whitening_.col(i) << U(0, 0), U(0, 1), U(0, 2), U(1, 1), U(1, 2), U(2, 2);
  }
}

double PoseLikelihood::evaluate(const antipode::Vector8<double>& pose) const {
  const Pose T = Pose::unchecked(pose);
  const Matrix3<double> R = T.rotation_matrix().transpose();
  const Vector3<double> t = -R * T.translation();
  const double bf = camera_.fx * camera_.baseline_m;
  const double* x = points_.row(0).data();
  const double* y = points_.row(1).data();
  const double* z = points_.row(2).data();
  const double* w = points_.row(3).data();
  const double* u_measured = measurements_.row(0).data();
  const double* v_measured = measurements_.row(1).data();
  const double* d_measured = measurements_.row(2).data();
  double sum = 0.0;
  for (Eigen::Index i = 0; i < points_.cols(); ++i) {
    const double hx = R(0, 0) * x[i] + R(0, 1) * y[i] + R(0, 2) * z[i] + t.x() * w[i];
    const double hy = R(1, 0) * x[i] + R(1, 1) * y[i] + R(1, 2) * z[i] + t.y() * w[i];
    const double hz = R(2, 0) * x[i] + R(2, 1) * y[i] + R(2, 2) * z[i] + t.z() * w[i];
    const double inverse = 1.0 / hz;
    const double du = u_measured[i] - (camera_.fx * hx * inverse + camera_.cx);
    const double dv = v_measured[i] - (camera_.fy * hy * inverse + camera_.cy);
    const double dd = d_measured[i] - bf * w[i] * inverse;
    const double a = whitening_(0, i) * du + whitening_(1, i) * dv + whitening_(2, i) * dd;
    const double b = whitening_(3, i) * dv + whitening_(4, i) * dd;
    const double c = whitening_(5, i) * dd;
    const double distance2 = a * a + b * b + c * c;
    const bool visible = hz > StereoCamera::kMinDepth_m * w[i] && distance2 < cap_;
    sum += visible ? distance2 : cap_;
  }
  return -0.5 * sum;
}

}  // namespace stereo_slam
