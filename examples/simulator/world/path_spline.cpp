// SPDX-License-Identifier: MIT
#include "simulator/world/path_spline.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

namespace stereo_slam::simulator {
namespace {

/// Second derivatives of the natural cubic spline through the columns, at distances of `step`: zero at both
/// ends, and M[i-1] + 4 M[i] + M[i+1] = 6 (y[i-1] - 2 y[i] + y[i+1]) / step^2 in between, by elimination.
template <class Values>
Values natural_spline(const Values& y, double step) {
  const Eigen::Index last = y.cols() - 1;
  Values M = Values::Zero(y.rows(), y.cols());
  std::vector<double> above(static_cast<std::size_t>(y.cols()), 0.0);
  for (Eigen::Index i = 1; i < last; ++i) {
    const double pivot = 4.0 - above[static_cast<std::size_t>(i - 1)];
    above[static_cast<std::size_t>(i)] = 1.0 / pivot;
    M.col(i) = (6.0 / (step * step) * (y.col(i - 1) - 2.0 * y.col(i) + y.col(i + 1)) - M.col(i - 1)) / pivot;
  }
  for (Eigen::Index i = last - 1; i > 0; --i) M.col(i) -= above[static_cast<std::size_t>(i)] * M.col(i + 1);
  return M;
}

}  // namespace

PathSpline::PathSpline(const CameraPath& path, double fps)
    : step_s_(1.0 / fps), values_(7, static_cast<Eigen::Index>(path.size())) {
  if (path.size() < 2) {
    throw std::invalid_argument("a motion needs at least two poses, not " + std::to_string(path.size()));
  }
  Eigen::Vector4d before = Eigen::Vector4d::Zero();
  for (std::size_t i = 0; i < path.size(); ++i) {
    const Eigen::Quaterniond rotation(path[i].linear());
    Eigen::Vector4d q(rotation.w(), rotation.x(), rotation.y(), rotation.z());
    if (q.dot(before) < 0.0) q = -q;  // q and -q are the same rotation, but not the same curve
    before = q;
    values_.col(static_cast<Eigen::Index>(i)) << path[i].translation(), q;
  }
  second_derivatives_ = natural_spline(values_, step_s_);
}

double PathSpline::duration_s() const { return step_s_ * static_cast<double>(values_.cols() - 1); }

BodyMotion PathSpline::at(double time_s) const {
  using Value = Eigen::Matrix<double, 7, 1>;
  const double h = step_s_;
  const auto i =
      std::clamp<Eigen::Index>(static_cast<Eigen::Index>(std::floor(time_s / h)), 0, values_.cols() - 2);
  const double u = time_s / h - static_cast<double>(i), w = 1.0 - u;
  const Value y0 = values_.col(i), y1 = values_.col(i + 1);
  const Value M0 = second_derivatives_.col(i), M1 = second_derivatives_.col(i + 1);
  const Value value = w * y0 + u * y1 + h * h / 6.0 * ((w * w * w - w) * M0 + (u * u * u - u) * M1);
  const Value first = (y1 - y0) / h + h / 6.0 * ((1.0 - 3.0 * w * w) * M0 + (3.0 * u * u - 1.0) * M1);
  const Value second = w * M0 + u * M1;

  const Eigen::Quaterniond q(value[3], value[4], value[5], value[6]);
  const Eigen::Quaterniond q_rate(first[3], first[4], first[5], first[6]);
  BodyMotion motion;
  motion.T_world_body = Eigen::Translation3d(value.head<3>()) * q.normalized();
  motion.velocity = first.head<3>();
  motion.acceleration = second.head<3>();
  // q' = q (s, w/2): the real part s is the change of the length.
  motion.angular_velocity = 2.0 * (q.conjugate() * q_rate).vec() / q.squaredNorm();
  return motion;
}

}  // namespace stereo_slam::simulator
