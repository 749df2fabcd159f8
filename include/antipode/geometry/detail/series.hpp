// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>

/// Scalar functions of an angle t [rad] with removable singularities at t = 0: series near zero, closed forms
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

/// Squared angle [rad^2] below which the series replace the closed forms. Their truncation error is below
/// 1.2e-16 there.
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

/// The HalfAngle of t^2.
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

/// The rotation angle t recovered from a unit quaternion with w = cos(t/2) >= 0, in the forms log needs.
template <class Scalar>
struct RecoveredAngle {
  Scalar inverse_sinc;  ///< t / sin(t/2): the rotation vector is this times the vector part
  Scalar sinc;          ///< sin(t/2) / t
  Scalar squared;       ///< t^2
};

/// The RecoveredAngle of w and sin^2(t/2).
template <class Scalar>
[[nodiscard]] RecoveredAngle<Scalar> recovered_angle(const Scalar& w, const Scalar& sine_squared) noexcept {
  using std::atan2;
  using std::sqrt;
  if (sine_squared < Scalar(kSeriesAngleSquared / 4.)) {  // 2 atan(r) / r / w with r = tan(t/2)
    const Scalar r_squared = sine_squared / (w * w);
    const Scalar inverse_sinc =
        polynomial(r_squared, 2., -2. / 3, 2. / 5, -2. / 7, 2. / 9, -2. / 11, 2. / 13) / w;
    return {inverse_sinc, Scalar(1) / inverse_sinc, inverse_sinc * inverse_sinc * sine_squared};
  }
  const Scalar sine = sqrt(sine_squared);
  const Scalar angle = Scalar(2) * atan2(sine, w);
  return {angle / sine, sine / angle, angle * angle};
}

/// The left Jacobian of SO(3) is I + a P + b P^2 with P = [phi]x. The slopes are a_slope = (da/dt) / t and
/// b_slope = (db/dt) / t.
template <class Scalar>
struct JacobianCoefficients {
  Scalar a;        ///< (1 - cos t) / t^2
  Scalar b;        ///< (t - sin t) / t^3
  Scalar a_slope;  ///< (t sin t + 2 cos t - 2) / t^4
  Scalar b_slope;  ///< (3 sin t - 2 t - t cos t) / t^5
};

/// The JacobianCoefficients of t^2.
template <class Scalar>
[[nodiscard]] JacobianCoefficients<Scalar> jacobian_coefficients(const Scalar& angle_squared) noexcept {
  using std::cos;
  using std::sin;
  using std::sqrt;
  const Scalar& x = angle_squared;
  if (x < Scalar(kSeriesAngleSquared)) {
    return {polynomial(x, 1. / 2, -1. / 24, 1. / 720, -1. / 40320, 1. / 3628800),
            polynomial(x, 1. / 6, -1. / 120, 1. / 5040, -1. / 362880, 1. / 39916800),
            polynomial(x, -1. / 12, 1. / 180, -1. / 6720, 1. / 453600, -1. / 47900160),
            polynomial(x, -1. / 60, 1. / 1260, -1. / 60480, 1. / 4989600, -1. / 622702080)};
  }
  const Scalar t = sqrt(x);
  const Scalar half_sine = sin(Scalar(0.5) * t);
  const Scalar versine = Scalar(2) * half_sine * half_sine;  // 1 - cos t without cancellation
  const Scalar sine = sin(t);
  return {versine / x, (t - sine) / (x * t), (t * sine - Scalar(2) * versine) / (x * x),
          (Scalar(3) * (sine - t) + t * versine) / (x * x * t)};
}

/// The inverse of the left Jacobian of SO(3) is I - P/2 + k P^2 with P = [phi]x; k_slope = (dk/dt) / t.
/// Singular at t = 2 pi.
template <class Scalar>
struct InverseJacobianCoefficients {
  Scalar k;        ///< (1 - (t/2) cot(t/2)) / t^2; 1/pi^2 at t = pi
  Scalar k_slope;  ///< (1 / (4 sin^2(t/2)) - 1 / t^2 - k) / t^2
};

/// The InverseJacobianCoefficients of t^2.
template <class Scalar>
[[nodiscard]] InverseJacobianCoefficients<Scalar> inverse_jacobian_coefficients(
    const Scalar& angle_squared) noexcept {
  using std::cos;
  using std::sin;
  using std::sqrt;
  const Scalar& x = angle_squared;
  if (x < Scalar(kSeriesAngleSquared)) {
    return {polynomial(x, 1. / 12, 1. / 720, 1. / 30240, 1. / 1209600, 1. / 47900160),
            polynomial(x, 1. / 360, 1. / 7560, 1. / 201600, 1. / 5987520, 691. / 130767436800)};
  }
  const Scalar half = Scalar(0.5) * sqrt(x);
  const Scalar sine = sin(half);
  const Scalar k = (Scalar(1) - half * cos(half) / sine) / x;
  return {k, (Scalar(0.25) / (sine * sine) - Scalar(1) / x - k) / x};
}

}  // namespace antipode::detail
