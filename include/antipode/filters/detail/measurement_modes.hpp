// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <type_traits>

#include <antipode/detail/cholesky.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/filters/detail/mode_search.hpp>
#include <antipode/filters/detail/sqrt_gaussian.hpp>

namespace antipode::detail {

/// What chi-square with that many degrees of freedom exceeds one time in a hundred, to about a hundredth (E.
/// B. Wilson and M. M. Hilferty, "The distribution of chi-square", 1931).
template <class Scalar>
[[nodiscard]] Scalar exceeded_by_one_of_hundred(Scalar degrees_of_freedom) {
  constexpr Scalar kQuantile = Scalar(2.326);  // of the normal distribution
  const Scalar variance = Scalar(2) / (Scalar(9) * degrees_of_freedom);
  const Scalar root = Scalar(1) - variance + kQuantile * std::sqrt(variance);
  return degrees_of_freedom * root * root * root;
}

/// The Gaussian log-likelihood of measurements with their model h. Counts its evaluations.
template <class Density, class Measurements, class Model>
struct MeasurementLikelihood {
  using Scalar = typename Density::Scalar;
  using State = typename Density::Chart::Point;
  static constexpr int N = Density::Chart::kDim;

  const Measurements& measurements;
  const Model& h;
  long& evaluations;

  /// Without constants; -infinity if a measurement cannot be predicted.
  [[nodiscard]] Scalar at(const State& state) const {
    using Z = std::remove_cvref_t<decltype(measurements[0].z)>;
    constexpr int kDim = Z::RowsAtCompileTime;
    ++evaluations;
    Scalar sum(0);
    const std::size_t count = measurements.size();
    for (std::size_t i = 0; i < count; ++i) {
      const std::optional<Z> predicted = h(state, i);
      const auto root = cholesky_factor<Scalar, kDim>(measurements[i].R);
      if (!predicted || !root) return -std::numeric_limits<Scalar>::infinity();
      const Z innovation = measurements[i].z - *predicted;
      sum -= Scalar(0.5) * solve_lower<Scalar, kDim, 1>(*root, innovation).squaredNorm();
    }
    return sum;
  }

  /// The number of measured numbers.
  [[nodiscard]] Scalar degrees_of_freedom() const {
    Scalar sum(0);
    const std::size_t count = measurements.size();
    for (std::size_t i = 0; i < count; ++i) sum += Scalar(measurements[i].z.size());
    return sum;
  }

  /// Whether prior times likelihood has a second mode: see detail::has_second_mode.
  template <class Local>
  [[nodiscard]] bool has_second_mode(const SqrtGaussian<Density>& prior,
                                     const SqrtGaussian<Density>& posterior, Scalar log_evidence,
                                     Local& local_model) const {
    // All places of a search; fewer at once if their vectors would exceed what Eigen puts on the stack.
    constexpr int kFit = EIGEN_STACK_ALLOCATION_LIMIT / static_cast<int>(sizeof(Scalar)) / N;
    constexpr int kCount = std::max(2 * N + 1, std::min(16 * N + 1, kFit));
    const auto evaluate = [&](const Matrix<Scalar, N, kCount>& tangents, Vector<Scalar, kCount>& values) {
      for (int k = 0; k < kCount; ++k) {
        values[k] = at(Density::Chart::retract(posterior.mean, tangents.col(k)));
      }
    };
    // At its mode the log-density is minus half the NIS.
    const Scalar least = Scalar(-0.5) * exceeded_by_one_of_hundred<Scalar>(degrees_of_freedom());
    return detail::has_second_mode<kCount>(prior, posterior, {log_evidence, least}, evaluate, local_model);
  }
};

}  // namespace antipode::detail
