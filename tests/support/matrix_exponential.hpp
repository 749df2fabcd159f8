// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>

#include <antipode/eigen_types.hpp>

namespace antipode::test {

/// exp(A) by scaling, twenty terms of the series, and squaring, in extended precision: an oracle for closed
/// forms.
template <int N>
[[nodiscard]] Matrix<double, N> matrix_exponential(const Matrix<double, N>& A) {
  using Wide = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
  const double size = A.cwiseAbs().sum();
  const int squarings = size > 0.5 ? static_cast<int>(std::ceil(std::log2(size / 0.5))) : 0;
  const Wide scaled = A.template cast<long double>() * std::exp2(static_cast<long double>(-squarings));
  Wide power = Wide::Identity(N, N), sum = power;
  for (int k = 1; k <= 20; ++k) {
    power = (power * scaled / static_cast<long double>(k)).eval();
    sum += power;
  }
  for (int i = 0; i < squarings; ++i) sum = (sum * sum).eval();
  return sum.cast<double>();
}

}  // namespace antipode::test
