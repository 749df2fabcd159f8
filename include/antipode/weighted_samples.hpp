// SPDX-License-Identifier: MIT
#pragma once

#include <antipode/eigen_types.hpp>

/// @file
/// Weighted points: the output of sigma point rules.
namespace antipode {

/// A discrete density: `Count` points of R^Dim (the columns) with non-negative weights that sum to one.
///
/// Everything is stored in place (no heap). Poses are 8-vectors [q; p] (see DualQuaternion), orientations are
/// 4-vectors (w, x, y, z) and represent both q and -q.
template <class Scalar_, int Dim_, int Count_>
struct WeightedSamples {
  using Scalar = Scalar_;                ///< of points and weights
  static constexpr int kDim = Dim_;      ///< of the points
  static constexpr int kCount = Count_;  ///< number of points

  Matrix<Scalar, Dim_, Count_> points;  ///< one in each column
  Vector<Scalar, Count_> weights;       ///< of the points, in the same order

  /// The number of points.
  [[nodiscard]] static constexpr int size() noexcept { return Count_; }
};

}  // namespace antipode
