// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

#include <antipode/eigen_types.hpp>

/// Probabilities of boxes under Gaussians of a few dimensions.
///
/// One coordinate after the other is drawn within its limits given those before it, and the probabilities of
/// the limits multiply (A. Genz, "Numerical computation of multivariate normal probabilities", 1992). The
/// draws are always the same lattice, which is far more accurate than random draws in so few dimensions.
namespace antipode::detail {

[[nodiscard]] inline double standard_normal_cdf(double x) {
  return 0.5 * std::erfc(-x / std::numbers::sqrt2);
}

/// The inverse of standard_normal_cdf, to 1e-9 relative (P. Acklam's rational approximation, 2003).
[[nodiscard]] inline double standard_normal_quantile(double p) {
  constexpr std::array a{-3.969683028665376e+01, 2.209460984245205e+02,  -2.759285104469687e+02,
                         1.383577518672690e+02,  -3.066479806614716e+01, 2.506628277459239e+00};
  constexpr std::array b{-5.447609879822406e+01, 1.615858368580409e+02, -1.556989798598866e+02,
                         6.680131188771972e+01, -1.328068155288572e+01};
  constexpr std::array c{-7.784894002430293e-03, -3.223964580411365e-01, -2.400758277161838e+00,
                         -2.549732539343734e+00, 4.374664141464968e+00,  2.938163982698783e+00};
  constexpr std::array d{7.784695709041462e-03, 3.224671290700398e-01, 2.445134137142996e+00,
                         3.754408661907416e+00};
  constexpr double kTail = 0.02425;
  const auto polynomial = [](const auto& coefficients, double x, double value) {
    for (const double coefficient : coefficients) value = value * x + coefficient;
    return value;
  };
  if (p < kTail || p > 1.0 - kTail) {
    const double q = std::sqrt(-2.0 * std::log(std::min(p, 1.0 - p)));
    const double x = polynomial(c, q, 0.0) / (polynomial(d, q, 0.0) * q + 1.0);
    return p < kTail ? x : -x;
  }
  const double q = p - 0.5, r = q * q;
  return polynomial(a, r, 0.0) * q / (polynomial(b, r, 0.0) * r + 1.0);
}

struct BoxProbability {
  double probability;
  double standard_error;  ///< from the scatter over shifts of the lattice
};

/// E[1(lower <= x <= upper) weight(x)] for x = mean + L z, z ~ N(0, I), L lower triangular with a positive
/// diagonal. Limits may be infinite.
template <int Dim, class Weight>
[[nodiscard]] BoxProbability gaussian_box_probability(const Vector<double, Dim>& mean,
                                                      const Matrix<double, Dim>& L,
                                                      const Vector<double, Dim>& lower,
                                                      const Vector<double, Dim>& upper,
                                                      const Weight& weight) {
  static_assert(Dim <= 6);
  constexpr std::array kPrimes{2.0, 3.0, 5.0, 7.0, 11.0, 13.0};
  constexpr int kShifts = 8, kPoints = 1024;
  constexpr double kTiny = 1e-300;
  Vector<double, kShifts> estimates = Vector<double, kShifts>::Zero();
  for (int shift = 0; shift < kShifts; ++shift) {
    for (int k = 0; k < kPoints; ++k) {
      double probability = 1.0;
      Vector<double, Dim> z = Vector<double, Dim>::Zero(), x;
      for (int i = 0; i < Dim && probability > kTiny; ++i) {
        double center = mean[i];
        for (int j = 0; j < i; ++j) center += L(i, j) * z[j];
        const double low = standard_normal_cdf((lower[i] - center) / L(i, i));
        const double width = standard_normal_cdf((upper[i] - center) / L(i, i)) - low;
        const double irrational = std::sqrt(kPrimes[static_cast<std::size_t>(i)]);
        const double draw = std::fmod((k + 1 + kPoints * shift) * irrational, 1.0);
        const double folded = std::abs(2.0 * draw - 1.0);  // periodic, as the lattice requires
        z[i] = standard_normal_quantile(std::clamp(low + folded * width, kTiny, 1.0 - 1e-16));
        x[i] = center + L(i, i) * z[i];
        probability *= std::max(0.0, width);
      }
      if (probability > kTiny) estimates[shift] += probability * weight(x) / kPoints;
    }
  }
  const double average = estimates.mean();
  double squares = 0.0;
  for (int shift = 0; shift < kShifts; ++shift) squares += std::pow(estimates[shift] - average, 2);
  return {average, std::sqrt(squares / (kShifts * (kShifts - 1.0)))};
}

}  // namespace antipode::detail
