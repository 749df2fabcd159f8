// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include <antipode/detail/cholesky.hpp>
#include <antipode/detail/standard_normal.hpp>
#include <antipode/eigen_types.hpp>

namespace antipode::detail {

/// Exact draws of u with a density proportional to N(u; mu, S) g(u), g(u) = (1 + |u|^2)^-2, by rejection from
///
///   g(r) N(u; mu, S)   where |u| >= r,   max_{|v| <= r} N(v; mu, S) g(u)   elsewhere
///
/// for a radius r below |mu|. The first part is drawn from the Gaussian, the second from the uniform density
/// of S^3, whose central projection is g/pi^2. Where the mean is far off centre, g is small all over the
/// Gaussian, and a Gaussian alone (r = 0) would be accepted once in |mu|^4 draws.
template <class Scalar>
class OffCenterRejection {
 public:
  /// L is the lower triangular root of S.
  OffCenterRejection(const Vector3<Scalar>& mean, const Matrix3<Scalar>& L)
      : mean_(mean), L_(L), norm_(mean.norm()) {
    using std::exp;
    using std::log;
    const Vector3<Scalar> along_mean = L.transpose() * (mean / norm_);
    sigma_ = along_mean.norm();
    log_peak_ = -Scalar(1.5) * log(Scalar(2) * std::numbers::pi_v<Scalar>) - log(L.diagonal().prod());
    Scalar least = std::numeric_limits<Scalar>::infinity();
    for (int k = 0; k < 12; ++k) {
      const Scalar radius = norm_ * (Scalar(1) - std::pow(Scalar(0.5), Scalar(k)));
      const Scalar inner = k == 0 ? Scalar(0) : kHalfSphereArea * exp(log_bound(radius));
      const Scalar outer = log_shrinkage(radius * radius);
      const Scalar mass = exp(outer) + inner;
      if (!(mass < least)) continue;
      least = mass;
      radius_ = radius;
      inner_share_ = inner / mass;
    }
    if (const Scalar uniform = kHalfSphereArea * exp(log_peak_); uniform < least) {
      radius_ = std::numeric_limits<Scalar>::infinity();
      inner_share_ = Scalar(1);
    }
  }

  /// z with u = mean + L z.
  template <std::uniform_random_bit_generator Rng>
  [[nodiscard]] Vector3<Scalar> draw(Rng& rng) const {
    using std::log;
    std::uniform_real_distribution<Scalar> uniform;
    for (;;) {
      if (uniform(rng) < inner_share_) {
        const Vector4<Scalar> q = standard_normal<Scalar, 4>(rng);
        const Vector3<Scalar> u = q.template tail<3>() / q[0];
        if (!(u.norm() < radius_)) continue;
        Vector3<Scalar> z = solve_lower<Scalar, 3, 1>(L_, u - mean_);
        if (log(uniform(rng)) < log_peak_ - Scalar(0.5) * z.squaredNorm() - log_bound(radius_)) return z;
      } else {
        Vector3<Scalar> z = standard_normal<Scalar, 3>(rng);
        const Scalar squared = (mean_ + L_ * z).squaredNorm();
        if (squared < radius_ * radius_ && inner_share_ > Scalar(0)) continue;
        if (log(uniform(rng)) < log_shrinkage(squared) - log_shrinkage(radius_ * radius_)) return z;
      }
    }
  }

 private:
  // Half the area of S^3: the integral of g over R^3.
  static constexpr Scalar kHalfSphereArea = std::numbers::pi_v<Scalar> * std::numbers::pi_v<Scalar>;

  /// log g.
  [[nodiscard]] static Scalar log_shrinkage(Scalar squared_norm) {
    return Scalar(-2) * std::log1p(squared_norm);
  }
  /// An upper bound of log N(v; mu, S) for |v| <= radius. In the direction of the mean, where the Gaussian
  /// has the standard deviation sigma_, every such v is at least norm_ - radius from the mean.
  [[nodiscard]] Scalar log_bound(Scalar radius) const {
    const Scalar distance = std::max(Scalar(0), norm_ - radius) / sigma_;
    return log_peak_ - Scalar(0.5) * distance * distance;
  }

  Vector3<Scalar> mean_;
  Matrix3<Scalar> L_;
  Scalar norm_;
  Scalar sigma_;  ///< along the mean
  Scalar log_peak_;
  Scalar radius_ = 0;
  Scalar inner_share_ = 0;  ///< of the envelope's mass
};

}  // namespace antipode::detail
