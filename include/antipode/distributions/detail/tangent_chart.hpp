// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include <antipode/detail/check.hpp>
#include <antipode/detail/products.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/geometry/jacobians.hpp>
#include <antipode/geometry/quaternion.hpp>

namespace antipode {

/// How Gaussians pass through a change of coordinates or a composition.
enum class Transport {
  kLinearized,  ///< by the Jacobian at the mean (MPG Eq. 16)
  kUnscented,   ///< by sigma points: better where u has a standard deviation above 0.1
};

}  // namespace antipode

/// Charts of the orientations by central projection: the tangent space of S^3 at q0 with the basis b_i = q0
/// e_i (MPG Eq. 7, where q_id is the identity), and how coordinates change from one tangent space to another.
namespace antipode::detail {

/// Pi(u) = q0 (1, u) / sqrt(1 + |u|^2) (MPG Eq. 8): a turn by 2 atan |u| about the axis u of the child's
/// frame.
template <class Scalar>
[[nodiscard]] Vector4<Scalar> central_projection(const Vector4<Scalar>& q0, const Vector3<Scalar>& u) {
  using std::sqrt;
  const Scalar scale = Scalar(1) / sqrt(Scalar(1) + u.squaredNorm());
  return hamilton_product(q0, Vector4<Scalar>(scale, scale * u[0], scale * u[1], scale * u[2]));
}

/// The coordinates u of q in the chart of q0 (MPG Eq. 10), the same for q and -q. None for rotations a
/// half-turn away from q0.
template <class Scalar>
[[nodiscard]] std::optional<Vector3<Scalar>> tangent_coordinates(const Vector4<Scalar>& q0,
                                                                 const Vector4<Scalar>& q) {
  using std::abs;
  constexpr Scalar kEquator = std::max(Scalar(1e-12), std::numeric_limits<Scalar>::epsilon());
  const Vector4<Scalar> r = hamilton_product(conjugate(q0), q);
  if (!(abs(r[0]) >= kEquator)) return std::nullopt;
  return Vector3<Scalar>(r[1] / r[0], r[2] / r[0], r[3] / r[0]);
}

/// (A + A^T) / 2.
template <class Scalar, int N>
[[nodiscard]] Matrix<Scalar, N> symmetrized(const Matrix<Scalar, N>& A) {
  return Scalar(0.5) * (A + A.transpose());
}

/// The log of the largest value of the Gaussian with the covariance L L^T on R^6.
template <class Scalar>
[[nodiscard]] Scalar gaussian_log_peak(const Matrix6<Scalar>& L) {
  using std::log;
  const Scalar upper = L(0, 0) * L(1, 1) * L(2, 2), lower = L(3, 3) * L(4, 4) * L(5, 5);
  return Scalar(-3) * log(Scalar(2) * std::numbers::pi_v<Scalar>) - log(upper) - log(lower);
}

/// The mean y = (0, t) of a density that is centred at its tangent point.
template <class Scalar>
[[nodiscard]] Vector6<Scalar> centered_mean(const Vector3<Scalar>& t) {
  return {Scalar(0), Scalar(0), Scalar(0), t[0], t[1], t[2]};
}

/// Mean and covariance of a Gaussian on a tangent space, in the coordinates y = (u, t).
template <class Scalar>
struct TangentGaussian {
  Vector6<Scalar> mean;
  Matrix6<Scalar> covariance;
};

/// The covariance of (J u, t) for Sigma, that of (u, t).
template <class Scalar>
[[nodiscard]] Matrix6<Scalar> transform_rotation(const Matrix3<Scalar>& J, const Matrix6<Scalar>& Sigma) {
  const Matrix3<Scalar> uu = congruence<Scalar, 3, 3>(J, Sigma.template topLeftCorner<3, 3>());
  const Matrix3<Scalar> ut = J * Matrix3<Scalar>(Sigma.template topRightCorner<3, 3>());
  Matrix6<Scalar> result = Sigma;
  result.template topLeftCorner<3, 3>() = symmetrized(uu);
  result.template topRightCorner<3, 3>() = ut;
  result.template bottomLeftCorner<3, 3>() = ut.transpose();
  return result;
}

/// The change of coordinates f = Pi_to^-1 o Pi_from between two charts (MPG Eq. 15), a projective map:
///
///   f(u) = (r_v + (r_0 I + [r_v]x) u) / y(u),   y(u) = r_0 - r_v.u,   r = to* from with r_0 >= 0
///
/// Its remainder is known exactly: f(u + d) = f(u) + J d / (1 - rho) with rho = r_v.d / y(u).
template <class Scalar>
class ChartChange {
 public:
  ChartChange(const Vector4<Scalar>& from, const Vector4<Scalar>& to) {
    const Vector4<Scalar> r = hamilton_product(conjugate(to), from);
    const Scalar sign = r[0] < Scalar(0) ? Scalar(-1) : Scalar(1);
    r0_ = sign * r[0];
    rv_ = sign * r.template tail<3>();
  }

  /// f(u). Throws where u is at the edge of the new chart.
  [[nodiscard]] Vector3<Scalar> operator()(const Vector3<Scalar>& u) const {
    return (rv_ + r0_ * u + rv_.cross(u)) / denominator(u);
  }

  /// J = df/du = (r_0 I + [r_v]x + f r_v^T) / y.
  [[nodiscard]] Matrix3<Scalar> jacobian(const Vector3<Scalar>& u) const {
    const Vector3<Scalar> f = (*this)(u);
    Matrix3<Scalar> J = skew(rv_);
    add_outer_product(Scalar(1), f, rv_, J);
    for (int i = 0; i < 3; ++i) J(i, i) += r0_;
    return J / denominator(u);
  }

  /// log det J = -4 log y.
  [[nodiscard]] Scalar log_determinant(const Vector3<Scalar>& u) const {
    using std::log;
    return Scalar(-4) * log(denominator(u));
  }

  /// The Gaussian pushed through the linearised f (MPG Eq. 16).
  [[nodiscard]] TangentGaussian<Scalar> linearized(const TangentGaussian<Scalar>& y) const {
    const Vector3<Scalar> u = y.mean.template head<3>();
    TangentGaussian<Scalar> result{y.mean, transform_rotation(jacobian(u), y.covariance)};
    result.mean.template head<3>() = (*this)(u);
    return result;
  }

  /// The standard deviation of rho over the Gaussian: how far f is from linear there.
  [[nodiscard]] Scalar nonlinearity(const TangentGaussian<Scalar>& y) const {
    using std::sqrt;
    const Matrix3<Scalar> S = y.covariance.template topLeftCorner<3, 3>();
    const Scalar variance = rv_.dot(S * rv_);
    return sqrt(std::max(Scalar(0), variance)) / denominator(y.mean.template head<3>());
  }

 private:
  [[nodiscard]] Scalar denominator(const Vector3<Scalar>& u) const {
    constexpr Scalar kEdge = Scalar(0.05);
    const Scalar y = r0_ - rv_.dot(u);
    if (!(y > kEdge)) [[unlikely]] {
      throw_invalid("tangent coordinates lie at the edge of the new tangent space, at u", u);
    }
    return y;
  }

  Scalar r0_;
  Vector3<Scalar> rv_;
};

/// The mean and covariance of f(mean + L z), z ~ N(0, I), for f: R^Dim -> R^6, by the 2 Dim points
/// +-sqrt(Dim) e_i of z (see CubatureRule).
template <int Dim, class Scalar, class Function>
[[nodiscard]] TangentGaussian<Scalar> unscented(const Vector<Scalar, Dim>& mean, const Matrix<Scalar, Dim>& L,
                                                const Function& f) {
  using std::sqrt;
  constexpr int kCount = 2 * Dim;
  const Scalar spread = sqrt(Scalar(Dim));
  Matrix<Scalar, 6, kCount> points;
  for (int i = 0; i < Dim; ++i) {
    points.col(2 * i) = f(mean + spread * L.col(i));
    points.col(2 * i + 1) = f(mean - spread * L.col(i));
  }
  TangentGaussian<Scalar> result{points.rowwise().sum() / Scalar(kCount), Matrix6<Scalar>::Zero()};
  for (int i = 0; i < kCount; ++i) {
    const Vector6<Scalar> deviation = points.col(i) - result.mean;
    add_outer_product(Scalar(1) / Scalar(kCount), deviation, deviation, result.covariance);
  }
  return result;
}

/// The Gaussian y, with L L^T its covariance, in another chart.
template <class Scalar>
[[nodiscard]] TangentGaussian<Scalar> change_chart(Transport transport, const ChartChange<Scalar>& f,
                                                   const TangentGaussian<Scalar>& y,
                                                   const Matrix6<Scalar>& L) {
  if (transport == Transport::kLinearized) return f.linearized(y);
  return unscented<6>(y.mean, L, [&](const Vector6<Scalar>& point) {
    Vector6<Scalar> moved = point;
    moved.template head<3>() = f(point.template head<3>());
    return moved;
  });
}

/// The Gaussian with its chart moved to its own mode, so that the mean of u is zero (MPG's PG0): with u the
/// old mean, J = (I - [u]x) / (1 + |u|^2).
template <class Scalar>
[[nodiscard]] TangentGaussian<Scalar> centered(const TangentGaussian<Scalar>& y) {
  const Vector3<Scalar> u = y.mean.template head<3>();
  const Matrix3<Scalar> J = (Matrix3<Scalar>::Identity() - skew(u)) / (Scalar(1) + u.squaredNorm());
  TangentGaussian<Scalar> result{y.mean, transform_rotation(J, y.covariance)};
  result.mean.template head<3>().setZero();
  return result;
}

}  // namespace antipode::detail
