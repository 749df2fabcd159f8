// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <numbers>
#include <utility>

#include <antipode/eigen_types.hpp>

namespace antipode::test {

/// Node and weight k of the n-point Gauss-Legendre rule on [-1, 1].
[[nodiscard]] inline std::pair<double, double> gauss_legendre(int n, int k) {
  double x = std::cos(std::numbers::pi * (k + 0.75) / (n + 0.5)), slope = 0.0;
  for (int iteration = 0; iteration < 20; ++iteration) {
    double previous = 1.0, value = x;
    for (int degree = 2; degree <= n; ++degree) {
      previous = std::exchange(value, ((2 * degree - 1) * x * value - (degree - 1) * previous) / degree);
    }
    slope = n * (x * value - previous) / (x * x - 1.0);
    x -= value / slope;
  }
  return {x, 2.0 / ((1.0 - x * x) * slope * slope)};
}

/// The integral of f over the unit sphere of R^4, in torus coordinates (cos a e^(ib), sin a e^(ic)): the
/// oracle for moments of smooth densities. Exact to about 1e-12 for exp(x^T C x) with concentrations down to
/// -50.
template <class Result, class Function>
[[nodiscard]] Result integrate_over_s3(const Function& f, Result sum) {
  constexpr int kPolar = 48, kAzimuth = 64;
  const double step = 2.0 * std::numbers::pi / kAzimuth;
  for (int i = 0; i < kPolar; ++i) {
    const auto [x, weight] = gauss_legendre(kPolar, i);
    const double a = std::numbers::pi / 4.0 * (1.0 + x);
    const double area = std::numbers::pi / 4.0 * weight * std::sin(a) * std::cos(a) * step * step;
    for (int j = 0; j < kAzimuth; ++j) {
      for (int k = 0; k < kAzimuth; ++k) {
        const Vector4<double> q(std::cos(a) * std::cos(step * j), std::cos(a) * std::sin(step * j),
                                std::sin(a) * std::cos(step * k), std::sin(a) * std::sin(step * k));
        sum += area * f(q);
      }
    }
  }
  return sum;
}

}  // namespace antipode::test
