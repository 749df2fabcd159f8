// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>

#include <antipode/eigen_types.hpp>

/// The product of two dual quaternions, three quaternion products: [q_x q_y; q_x p_y + p_x q_y].
namespace antipode::detail {

/// Written out entry by entry: with products of vectors GCC stores and reloads every intermediate vector,
/// which takes half of the time.
template <class A, class B>
[[nodiscard]] Vector8<typename A::Scalar> dual_quaternion_product(const A& a, const B& b) noexcept {
  return {a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
          a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
          a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
          a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
          (a[0] * b[4] - a[1] * b[5] - a[2] * b[6] - a[3] * b[7]) +
              (a[4] * b[0] - a[5] * b[1] - a[6] * b[2] - a[7] * b[3]),
          (a[0] * b[5] + a[1] * b[4] + a[2] * b[7] - a[3] * b[6]) +
              (a[4] * b[1] + a[5] * b[0] + a[6] * b[3] - a[7] * b[2]),
          (a[0] * b[6] - a[1] * b[7] + a[2] * b[4] + a[3] * b[5]) +
              (a[4] * b[2] - a[5] * b[3] + a[6] * b[0] + a[7] * b[1]),
          (a[0] * b[7] + a[1] * b[6] - a[2] * b[5] + a[3] * b[4]) +
              (a[4] * b[3] + a[5] * b[2] - a[6] * b[1] + a[7] * b[0])};
}

#if defined(__GNUC__) && defined(__has_builtin)
#if __has_builtin(__builtin_shufflevector)
/// Two doubles in one register: an extension of GCC and Clang that works on every processor.
using DoublePair [[gnu::vector_size(16)]] = double;

/// The same product for doubles, two rows at a time, with a result that is equal bit for bit. GCC does not
/// vectorise the version above, which takes a quarter longer.
template <class A, class B>
requires std::same_as<typename A::Scalar, double> && std::same_as<typename B::Scalar, double>
[[nodiscard]] Vector8<double> dual_quaternion_product(const A& a, const B& b) noexcept {
  const auto swapped = [](DoublePair v) { return __builtin_shufflevector(v, v, 1, 0); };
  const DoublePair b01{b[0], b[1]}, b23{b[2], b[3]}, b45{b[4], b[5]}, b67{b[6], b[7]};
  const DoublePair b10 = swapped(b01), b32 = swapped(b23), b54 = swapped(b45), b76 = swapped(b67);
  const DoublePair a0{a[0], a[0]}, a1{-a[1], a[1]}, a2{-a[2], a[2]}, a3{a[3], a[3]};
  const DoublePair a4{a[4], a[4]}, a5{-a[5], a[5]}, a6{-a[6], a[6]}, a7{a[7], a[7]};
  const DoublePair q01 = a0 * b01 + a1 * b10 + a2 * b23 - a3 * b32;
  const DoublePair q23 = a0 * b23 + a1 * b32 - a2 * b01 + a3 * b10;
  const DoublePair p01 =
      (a0 * b45 + a1 * b54 + a2 * b67 - a3 * b76) + (a4 * b01 + a5 * b10 + a6 * b23 - a7 * b32);
  const DoublePair p23 =
      (a0 * b67 + a1 * b76 - a2 * b45 + a3 * b54) + (a4 * b23 + a5 * b32 - a6 * b01 + a7 * b10);
  return {q01[0], q01[1], q23[0], q23[1], p01[0], p01[1], p23[0], p23[1]};
}
#endif
#endif

}  // namespace antipode::detail
