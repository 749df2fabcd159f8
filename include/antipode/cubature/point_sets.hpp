// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <concepts>
#include <numbers>
#include <random>

#include <antipode/detail/check.hpp>
#include <antipode/detail/cholesky.hpp>
#include <antipode/detail/products.hpp>
#include <antipode/detail/standard_normal.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/weighted_samples.hpp>

/// @file
/// Sigma points for N(0, I), any even number of them.
namespace antipode {

/// A Gaussian rule of any even number of points: Count/2 points spread like N(0, I) and their negatives, with
/// equal weights, whitened so that the second moments are exact. Built once, then used like the other rules
/// (GnomonicRule{PointSetRule<3, 40>::fibonacci()} samples a Bingham density at 40 orientations).
template <int Dim, int Count>
requires(Count % 2 == 0 && Count / 2 >= Dim) class PointSetRule {
 public:
  static constexpr int kDim = Dim;      ///< of the points
  static constexpr int kCount = Count;  ///< number of points

  /// Points drawn at random. Throws if the draws span no volume, which no working generator produces.
  template <std::uniform_random_bit_generator Rng>
  [[nodiscard]] static PointSetRule random(Rng& rng) {
    HalfSet half;
    for (int k = 0; k < kPairs; ++k) half.col(k) = detail::standard_normal<double, Dim>(rng);
    return PointSetRule(half);
  }

  /// Points spread evenly: the directions are a Fibonacci spiral on the half-sphere; the radii are quantiles
  /// of the chi distribution with three degrees of freedom, in an order shuffled by an irrational step.
  [[nodiscard]] static PointSetRule fibonacci() requires(Dim == 3) {
    constexpr double kGoldenAngle = std::numbers::pi * (3.0 - 2.236067977499789696);
    constexpr double kRadialStep = std::numbers::sqrt2 - 1.0;
    HalfSet half;
    for (int k = 0; k < kPairs; ++k) {
      const double height = (k + 0.5) / kPairs;
      const double radius = chi3_quantile(std::fmod((k + 0.5) * kRadialStep, 1.0));
      const double ring = std::sqrt(1.0 - height * height);
      half.col(k) = radius * Vector3<double>(ring * std::cos(k * kGoldenAngle),
                                             ring * std::sin(k * kGoldenAngle), height);
    }
    return PointSetRule(half);
  }

  /// The points for N(0, I), as columns, and their weights.
  template <std::floating_point Scalar>
  [[nodiscard]] WeightedSamples<Scalar, Dim, Count> standard() const {
    WeightedSamples<Scalar, Dim, Count> samples;
    samples.points.template leftCols<kPairs>() = half_.template cast<Scalar>();
    samples.points.template rightCols<kPairs>() = -samples.points.template leftCols<kPairs>();
    samples.weights.setConstant(Scalar(1) / Scalar(Count));
    return samples;
  }

 private:
  static constexpr int kPairs = Count / 2;
  using HalfSet = Matrix<double, Dim, kPairs>;

  /// Whitens twice: if few points nearly lie in a plane, the first whitening leaves rounding errors.
  explicit PointSetRule(const HalfSet& half) : half_(whitened(whitened(half))) {}

  [[nodiscard]] static HalfSet whitened(const HalfSet& half) {
    Matrix<double, Dim> covariance = Matrix<double, Dim>::Zero();
    for (int k = 0; k < kPairs; ++k) {
      const Vector<double, Dim> point = half.col(k);
      detail::add_outer_product(1.0 / kPairs, point, point, covariance);
    }
    const auto L = detail::cholesky_factor(covariance);
    if (!L) [[unlikely]] {
      detail::throw_invalid("the points of a rule span no volume, their covariance is", covariance);
    }
    return detail::solve_lower<double, Dim, kPairs>(*L, half);
  }

  /// r with P(|g| < r) = p for g ~ N(0, I_3), by bisection.
  [[nodiscard]] static double chi3_quantile(double p) {
    double low = 0.0, high = 10.0;
    for (int i = 0; i < 60; ++i) {
      const double r = 0.5 * (low + high);
      const double cumulative = std::erf(r / std::numbers::sqrt2) -
                                std::numbers::sqrt2 * std::numbers::inv_sqrtpi * r * std::exp(-0.5 * r * r);
      (cumulative < p ? low : high) = r;
    }
    return 0.5 * (low + high);
  }

  HalfSet half_;
};

}  // namespace antipode
