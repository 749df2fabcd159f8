// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>

#include <antipode/eigen_types.hpp>

#include "fuzz/fuzz_target.hpp"

namespace antipode::fuzz {

/// Numbers from bytes, among them those that break things. Zeros follow the last byte.
class HostileInput {
 public:
  explicit HostileInput(Bytes bytes) : bytes_(bytes) {}

  [[nodiscard]] bool empty() const { return bytes_.empty(); }

  std::uint8_t byte() {
    if (bytes_.empty()) return 0;
    const std::uint8_t first = bytes_.front();
    bytes_ = bytes_.subspan(1);
    return first;
  }

  /// From 0 to `count` - 1.
  unsigned choice(unsigned count) { return byte() % count; }

  /// Within [-8, 8).
  double ordinary() {
    const auto low = byte(), high = byte();
    return static_cast<double>(static_cast<std::int16_t>(high << 8 | low)) / 4096.0;
  }

  /// A positive number, from 1e-320 to 1e308, mostly near one.
  double scale() {
    const auto exponent = static_cast<std::int8_t>(byte());
    return std::pow(10.0, exponent > -64 && exponent < 64 ? exponent / 8.0 : 2.5 * exponent);
  }

  /// Any number at all; half of them are ordinary.
  double number() {
    constexpr double kPi = 3.14159265358979323846;
    using Limits = std::numeric_limits<double>;
    constexpr std::array kSpecial = {Limits::quiet_NaN(),
                                     Limits::infinity(),
                                     -Limits::infinity(),
                                     Limits::max(),
                                     Limits::lowest(),
                                     Limits::min(),
                                     Limits::denorm_min(),
                                     -0.0,
                                     1e154,
                                     1e-154,
                                     1.0,
                                     -1.0,
                                     kPi,
                                     -kPi,
                                     kPi / 2,
                                     1.0 + Limits::epsilon()};
    const unsigned kind = byte();
    if (kind < 128) return ordinary();
    if (kind < 192) return ordinary() * scale();
    if (kind < 208) return kSpecial[kind % kSpecial.size()];
    std::uint64_t bits = 0;
    for (int i = 0; i < 8; ++i) bits = bits << 8 | byte();
    double value = 0.0;
    std::memcpy(&value, &bits, sizeof value);
    return value;
  }

  template <int Rows, int Cols = 1>
  Matrix<double, Rows, Cols> numbers() {
    Matrix<double, Rows, Cols> result;
    for (double& value : result.reshaped()) value = number();
    return result;
  }

  template <int Rows, int Cols = 1>
  Matrix<double, Rows, Cols> ordinary_numbers() {
    Matrix<double, Rows, Cols> result;
    for (double& value : result.reshaped()) value = ordinary();
    return result;
  }

  /// What may be a covariance: of variances, of rounded squares, singular, or no covariance at all.
  template <int N>
  Matrix<double, N> covariance() {
    Matrix<double, N> P = Matrix<double, N>::Zero();
    const unsigned kind = choice(4);
    if (kind == 0) {
      for (int i = 0; i < N; ++i) P(i, i) = scale();
    } else if (kind < 3) {
      Matrix<double, N> root = ordinary_numbers<N, N>();
      for (int i = 0; i < N; ++i) root.row(i) *= kind == 1 ? 0.125 : std::sqrt(scale());
      P = root * root.transpose();
    } else {
      P = numbers<N, N>();
    }
    return P;
  }

 private:
  Bytes bytes_;
};

}  // namespace antipode::fuzz
