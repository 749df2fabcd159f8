// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <type_traits>

#include <antipode/detail/cholesky.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/filters/detail/mode_search.hpp>
#include <antipode/filters/detail/sqrt_gaussian.hpp>

namespace antipode::detail {

/// Whether prior times the Gaussian likelihood of the measurements has a second mode: see ModeSearch.
template <class Density, class Measurements, class Model>
[[nodiscard]] bool is_ambiguous(const SqrtGaussian<Density>& prior, const SqrtGaussian<Density>& posterior,
                                const Measurements& measurements, const Model& h, long& evaluations) {
  using Scalar = typename Density::Scalar;
  using Z = std::remove_cvref_t<decltype(measurements[0].z)>;
  constexpr int N = Density::Chart::kDim, kDim = Z::RowsAtCompileTime, kCount = 8 * N + 1;
  const auto evaluate = [&](const Matrix<Scalar, N, kCount>& tangents, Vector<Scalar, kCount>& values) {
    evaluations += kCount;
    values.setZero();
    for (int k = 0; k < kCount; ++k) {
      const auto state = Density::Chart::retract(posterior.mean, tangents.col(k));
      const std::size_t count = measurements.size();
      for (std::size_t i = 0; i < count; ++i) {
        const std::optional<Z> predicted = h(state, i);
        const auto root = cholesky_factor<Scalar, kDim>(measurements[i].R);
        if (!predicted || !root) {
          values[k] = -std::numeric_limits<Scalar>::infinity();
          break;
        }
        const Z innovation = measurements[i].z - *predicted;
        values[k] -= Scalar(0.5) * solve_lower<Scalar, kDim, 1>(*root, innovation).squaredNorm();
      }
    }
  };
  return has_second_mode<kCount>(prior, posterior, evaluate);
}

}  // namespace antipode::detail
