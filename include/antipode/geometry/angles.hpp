// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <concepts>
#include <numbers>

/// @file
/// Angles, which are the same after a full turn.
namespace antipode {

/// The angle [rad] in [-pi, pi]. NaN for an angle that is not finite.
template <std::floating_point Scalar>
[[nodiscard]] Scalar wrap_angle(Scalar angle) noexcept {
  return std::remainder(angle, Scalar(2) * std::numbers::pi_v<Scalar>);
}

/// The angle [rad] plus as many full turns as bring it within pi of the reference. NaN for an angle or a
/// reference that is not finite.
///
/// For a measured angle z and a model h, z - h(x) jumps by 2 pi where the two are on different sides of pi. A
/// filter then corrects by a full turn. Let the model return angle_near(z, h(x)) instead.
template <std::floating_point Scalar>
[[nodiscard]] Scalar angle_near(Scalar reference, Scalar angle) noexcept {
  return reference + wrap_angle(angle - reference);
}

}  // namespace antipode
