// SPDX-License-Identifier: MIT
#include "stereo_slam/tracking/pose_likelihood.hpp"

#include <algorithm>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "stereo_slam/local_map/landmark_projection.hpp"

namespace stereo_slam {

PoseLikelihood::PoseLikelihood(std::span<const Match> matches, const MapView& map, double cap)
    : camera_(map.camera), cap_(cap), count_(matches.size()) {
  Block empty;
  empty.point.fill(Lanes::Ones());
  empty.measurement.fill(Lanes::Zero());
  empty.U.fill(Lanes::Zero());
  empty.UV.fill(Lanes::Zero());
  empty.cap = 0.0;
  blocks_.assign((count_ + kLanes - 1) / kLanes, empty);
  for (std::size_t i = 0; i < count_; ++i) {
    const Match& match = matches[i];
    const Landmark& landmark = map.landmarks[match.landmark];
    const HomogeneousPoint point = to_point(landmark, landmark.mean, camera_);
    const Matrix3<double> S = match.predicted.landmark_part + match.R;
    const Matrix3<double> U = S.inverse().llt().matrixU();
    Block& block = blocks_[i / kLanes];
    const auto lane = static_cast<Eigen::Index>(i % kLanes);
    for (int k = 0; k < 3; ++k) {
      block.point[static_cast<std::size_t>(k)][lane] = point.x[k];
      block.measurement[static_cast<std::size_t>(k)][lane] = match.z[k];
    }
    block.point[3][lane] = point.w;
    std::size_t entry = 0;
    for (int row = 0; row < 3; ++row) {
      for (int column = row; column < 3; ++column) block.U[entry++][lane] = U(row, column);
    }
    block.cap[lane] = cap_;
  }
}

Matrix3<double> PoseLikelihood::whitening(std::size_t landmark) const {
  const Block& block = blocks_[landmark / kLanes];
  const auto lane = static_cast<Eigen::Index>(landmark % kLanes);
  Matrix3<double> U = Matrix3<double>::Zero();
  std::size_t entry = 0;
  for (int row = 0; row < 3; ++row) {
    for (int column = row; column < 3; ++column) U(row, column) = block.U[entry++][lane];
  }
  return U;
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
  Matrix6<double> remaining = Matrix6<double>::Identity();
  for (std::size_t i = 0; i < count_; ++i) {
    const Landmark& landmark = map.landmarks[matches[i].landmark];
    const Eigen::Matrix<double, 3, 6> UV = whitening(i) * landmark_jacobian(landmark, prior.pose, camera_) *
                                           landmark.pose_cross_covariance.transpose() *
                                           prior_whitening_.transpose();
    remaining -= UV.transpose() * UV;
    Block& block = blocks_[i / kLanes];
    for (int k = 0; k < 18; ++k) {
      block.UV[static_cast<std::size_t>(k)][static_cast<Eigen::Index>(i % kLanes)] = UV(k / 6, k % 6);
    }
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
  Lanes sum = Lanes::Zero();
  std::array<Lanes, 6> w_lanes;
  w_lanes.fill(Lanes::Zero());
  for (const Block& block : blocks_) {
    const auto& p = block.point;
    const auto& U = block.U;
    const auto& UV = block.UV;
    const Lanes hx = R(0, 0) * p[0] + R(0, 1) * p[1] + R(0, 2) * p[2] + t.x() * p[3];
    const Lanes hy = R(1, 0) * p[0] + R(1, 1) * p[1] + R(1, 2) * p[2] + t.y() * p[3];
    const Lanes hz = R(2, 0) * p[0] + R(2, 1) * p[1] + R(2, 2) * p[2] + t.z() * p[3];
    const Lanes inverse = 1.0 / hz;
    const Lanes du = block.measurement[0] - (camera_.fx * hx * inverse + camera_.cx);
    const Lanes dv = block.measurement[1] - (camera_.fy * hy * inverse + camera_.cy);
    const Lanes dd = block.measurement[2] - bf * p[3] * inverse;
    Lanes a = U[0] * du + U[1] * dv + U[2] * dd;
    Lanes b = U[3] * dv + U[4] * dd;
    Lanes c = U[5] * dd;
    if constexpr (Correlated) {
      for (std::size_t k = 0; k < 6; ++k) {
        const double y_k = y[static_cast<Eigen::Index>(k)];
        a -= UV[k] * y_k;
        b -= UV[6 + k] * y_k;
        c -= UV[12 + k] * y_k;
      }
    }
    const Lanes distance2 = a * a + b * b + c * c;
    for (Eigen::Index i = 0; i < distance2.size(); ++i) {
      const bool counts = hz[i] > StereoCamera::kMinDepth_m * p[3][i] && distance2[i] < cap_;
      sum[i] += counts ? distance2[i] : block.cap[i];
      a[i] = counts ? a[i] : 0.0;
      b[i] = counts ? b[i] : 0.0;
      c[i] = counts ? c[i] : 0.0;
    }
    if constexpr (Correlated) {
      for (std::size_t k = 0; k < 6; ++k) w_lanes[k] += UV[k] * a + UV[6 + k] * b + UV[12 + k] * c;
    }
  }
  for (std::size_t k = 0; k < 6; ++k) w[static_cast<Eigen::Index>(k)] += w_lanes[k].sum();
  return sum.sum();
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
