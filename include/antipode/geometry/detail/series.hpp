// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>

/// Scalar functions of an angle with removable singularities at zero: Taylor tails near it, closed forms
/// elsewhere.
///
/// All take the squared angle, so that they are differentiable at zero for dual-number scalars too.
namespace antipode::detail {

/// c0 + c1 x + c2 x^2 + ...
template <class Scalar>
[[nodiscard]] constexpr Scalar polynomial(const Scalar&, double c0) noexcept {
  return Scalar(c0);
}
template <class Scalar, class... Coefficients>
[[nodiscard]] constexpr Scalar polynomial(const Scalar& x, double c0, Coefficients... higher) noexcept {
  return Scalar(c0) + x * polynomial(x, higher...);
}

/// Squared angle below which the Taylor tails replace the closed forms; their truncation is below 1.2e-16
/// there.
inline constexpr double kSeriesAngleSquared = 0.01;

/// (cos(t/2) / 2 - s) / t^2 with s = sin(t/2) / t: the derivative of s by t, divided by t.
template <class Scalar>
[[nodiscard]] Scalar sinc_slope(const Scalar& cosine, const Scalar& sinc,
                                const Scalar& angle_squared) noexcept {
  if (angle_squared < Scalar(kSeriesAngleSquared)) {
    return polynomial(angle_squared, -1. / 24, 1. / 960, -1. / 107520, 1. / 23224320);
  }
  return (Scalar(0.5) * cosine - sinc) / angle_squared;
}

/// Functions of the rotation angle t = |phi| that the exponential of SE(3) is made of.
template <class Scalar>
struct HalfAngle {
  Scalar cosine;  ///< cos(t/2)
  Scalar sinc;    ///< s = sin(t/2) / t
  Scalar slope;   ///< sinc_slope(t)
};

template <class Scalar>
[[nodiscard]] HalfAngle<Scalar> half_angle(const Scalar& angle_squared) noexcept {
  using std::cos;
  using std::sin;
  using std::sqrt;
  const Scalar& x = angle_squared;
  if (x < Scalar(kSeriesAngleSquared)) {
    return {polynomial(x, 1., -1. / 8, 1. / 384, -1. / 46080, 1. / 10321920),
            polynomial(x, 1. / 2, -1. / 48, 1. / 3840, -1. / 645120, 1. / 185794560),
            sinc_slope(Scalar(1), Scalar(0.5), x)};
  }
  const Scalar angle = sqrt(x);
  const Scalar half = Scalar(0.5) * angle;
  const Scalar cosine = cos(half);
  const Scalar sinc = sin(half) / angle;
  return {cosine, sinc, sinc_slope(cosine, sinc, x)};
}

/// t / sin(t/2) for a unit quaternion with w >= 0: its rotation vector is this times its vector part.
template <class Scalar>
[[nodiscard]] Scalar angle_over_sine(const Scalar& w, const Scalar& sine_squared) noexcept {
  using std::atan2;
  using std::sqrt;
  if (sine_squared < Scalar(1e-16)) {
    return Scalar(2) / w * (Scalar(1) - sine_squared / (Scalar(3) * w * w));
  }
  const Scalar sine = sqrt(sine_squared);
  return Scalar(2) * atan2(sine, w) / sine;
}

/// Coefficients of the Jacobians as functions of the angle, all finite at zero.
template <class Scalar>
struct JacobianCoefficients {
  Scalar a;  ///< (1 - cos t) / t^2
  Scalar b;  ///< (t - sin t) / t^3
  Scalar c;  ///< (t^2 + 2 cos t - 2) / (2 t^4)
  Scalar d;  ///< (2 t - 3 sin t + t cos t) / (2 t^5)
};

template <class Scalar>
[[nodiscard]] JacobianCoefficients<Scalar> jacobian_coefficients(const Scalar& angle_squared) noexcept {
  using std::cos;
  using std::sin;
  using std::sqrt;
  const Scalar& x = angle_squared;
  if (x < Scalar(kSeriesAngleSquared)) {
    return {polynomial(x, 1. / 2, -1. / 24, 1. / 720, -1. / 40320, 1. / 3628800),
            polynomial(x, 1. / 6, -1. / 120, 1. / 5040, -1. / 362880, 1. / 39916800),
            polynomial(x, 1. / 24, -1. / 720, 1. / 40320, -1. / 3628800),
            polynomial(x, 1. / 120, -1. / 2520, 1. / 120960, -1. / 9979200)};
  }
  const Scalar t = sqrt(x);
  const Scalar sin_t = sin(t);
  const Scalar cos_t = cos(t);
  const Scalar half_sine = sin(t / Scalar(2));
  const Scalar two_versine = Scalar(4) * half_sine * half_sine;  // 2 (1 - cos t) without cancellation
  return {two_versine / (Scalar(2) * x), (t - sin_t) / (x * t), (x - two_versine) / (Scalar(2) * x * x),
          (Scalar(2) * t - Scalar(3) * sin_t + t * cos_t) / (Scalar(2) * x * x * t)};
}

/// (1 - (t/2) cot(t/2)) / t^2, the quadratic coefficient of the inverse Jacobian of SO(3); 1/pi^2 at t = pi.
template <class Scalar>
[[nodiscard]] Scalar inverse_jacobian_coefficient(const Scalar& angle_squared) noexcept {
  using std::sqrt;
  using std::tan;
  const Scalar& x = angle_squared;
  if (x < Scalar(kSeriesAngleSquared)) {
    return polynomial(x, 1. / 12, 1. / 720, 1. / 30240, 1. / 1209600, 1. / 47900160);
  }
  const Scalar half = sqrt(x) / Scalar(2);
  return (Scalar(1) - half / tan(half)) / x;
}

}  // namespace antipode::detail
