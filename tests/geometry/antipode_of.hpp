// SPDX-License-Identifier: MIT
#pragma once

#include <antipode/geometry/dual_quaternion.hpp>

namespace antipode::test {

/// The same pose with the other sign.
template <class Scalar>
[[nodiscard]] DualQuaternion<Scalar> antipode_of(const DualQuaternion<Scalar>& x) {
  return DualQuaternion<Scalar>::unchecked(-x.coeffs());
}

}  // namespace antipode::test
