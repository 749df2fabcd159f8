// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include <antipode/detail/check.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/filters/noisy_measurement.hpp>
#include <antipode/geometry/angles.hpp>

/// @file
/// Measured angles: bearings, headings, azimuths.
namespace antipode {

/// The model h with the given rows, angles [rad], brought within pi of those measured by full turns:
///
///     const GaussianMeasurements bearings(z, with_angles<0, 1>(z, h));
///
/// Every model of an angle that can come near pi needs this, or angle_near() in the model itself. Without, an
/// innovation z - h may be 2 pi too large, and the filter turns by a large part of it. No update can see that
/// for itself, because it does not know which numbers are angles; the nis of its result is far too large.
///
/// h is callable as h(state, i) or as h(state, i, J), and returns a vector or a std::optional of one. Throws
/// if a measurement has fewer rows. Predictions that are not finite stay so.
template <int... Rows, std::floating_point Scalar, int Dim, class Model>
[[nodiscard]] auto with_angles(const std::vector<NoisyMeasurement<Scalar, Dim>>& measurements, Model h) {
  static_assert(sizeof...(Rows) > 0, "with_angles: name the rows that are angles, with_angles<0>(z, h)");
  static_assert(((Rows >= 0 && (Dim == Eigen::Dynamic || Rows < Dim)) && ...),
                "with_angles: a measurement does not have that row");
  std::vector<Vector<Scalar, Dim>> measured;
  measured.reserve(measurements.size());
  for (const auto& m : measurements) {
    if (m.z.rows() <= std::max({Rows...})) [[unlikely]] {
      detail::throw_invalid("with_angles: a measurement does not have all rows that are angles", m.z);
    }
    measured.push_back(m.z);
  }
  return [ measured = std::move(measured), h = std::move(h) ]<class State, class... Jacobian>(
      const State& state, std::size_t i,
      Jacobian&... J) requires std::invocable<const Model&, const State&, std::size_t, Jacobian&...> {
    std::optional<Vector<Scalar, Dim>> predicted(h(state, i, J...));
    if (predicted && predicted->rows() == measured[i].rows()) {  // the updates refuse another length
      ((predicted->coeffRef(Rows) = angle_near(measured[i][Rows], (*predicted)[Rows])), ...);
    }
    return predicted;
  };
}

}  // namespace antipode
