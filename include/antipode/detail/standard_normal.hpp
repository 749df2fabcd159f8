// SPDX-License-Identifier: MIT
#pragma once

#include <random>

#include <antipode/eigen_types.hpp>

namespace antipode::detail {

/// A draw of N(0, I).
template <class Scalar, int N, std::uniform_random_bit_generator Rng>
[[nodiscard]] Vector<Scalar, N> standard_normal(Rng& rng) {
  std::normal_distribution<Scalar> normal;
  Vector<Scalar, N> x;
  for (Scalar& entry : x) entry = normal(rng);
  return x;
}

}  // namespace antipode::detail
