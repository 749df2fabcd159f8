// SPDX-License-Identifier: MIT
#pragma once

#include <bit>
#include <cmath>
#include <concepts>
#include <type_traits>

#include <antipode/detail/check.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/weighted_samples.hpp>

/// @file
/// Sigma points for N(0, I), in closed form.
namespace antipode {

/// A deterministic set of weighted points for N(0, I) on R^kDim.
///
/// Laws: the weights are non-negative and sum to one; the set is symmetric, g and -g with the same weight, so
/// that all odd moments vanish; the second moments are the identity. A rule exact to degree 5 has the fourth
/// moments of the Gaussian too: 3 for each coordinate, 1 for each pair.
template <class Rule>
concept GaussianRule = requires(const Rule& rule) {
  {
    rule.template standard<double>()
    } -> std::convertible_to<WeightedSamples<double, Rule::kDim, Rule::kCount>>;
  {
    rule.template standard<float>()
    } -> std::convertible_to<WeightedSamples<float, Rule::kDim, Rule::kCount>>;
};

namespace detail {

template <class Rule, int Dim>
concept GaussianRuleIn = GaussianRule<Rule> && Rule::kDim == Dim;

/// Sets 2 Dim columns of `points`, from column `first` on: radius e_1, ..., radius e_Dim, then their
/// negatives.
template <class Scalar, int Dim, int Count>
void set_axis_points(int first, Scalar radius, Matrix<Scalar, Dim, Count>& points) {
  for (int i = 0; i < Dim; ++i) {
    for (int j = 0; j < Dim; ++j) {
      points(j, first + i) = i == j ? radius : Scalar(0);
      points(j, first + Dim + i) = i == j ? -radius : Scalar(0);
    }
  }
}

}  // namespace detail

/// 2 Dim + 1 points: the centre with weight kappa/(Dim + kappa) and +-sqrt(Dim + kappa) e_i. Exact to degree
/// 3; the fourth moments are Dim + kappa and 0. Weights are non-negative for kappa >= 0; for kappa = 0 the
/// centre has no weight, and CubatureRule omits it. Reference: Julier and Uhlmann, "Unscented filtering and
/// nonlinear estimation", 2004.
template <int Dim>
struct UnscentedRule {
  static constexpr int kDim = Dim;            ///< of the points
  static constexpr int kCount = 2 * Dim + 1;  ///< number of points

  double kappa = Dim < 3 ? 3.0 - Dim : 0.0;  ///< not negative; sets the weight of the centre

  /// The points for N(0, I), as columns, and their weights. Throws unless kappa >= 0.
  template <std::floating_point Scalar>
  [[nodiscard]] WeightedSamples<Scalar, Dim, kCount> standard() const {
    using std::sqrt;
    if (!(kappa >= 0.0) || !std::isfinite(kappa)) [[unlikely]] {
      detail::throw_invalid("kappa of the unscented rule is not in [0, inf)", kappa);
    }
    const Scalar spread = static_cast<Scalar>(Dim + kappa);
    WeightedSamples<Scalar, Dim, kCount> samples;
    samples.points.col(0).setZero();
    detail::set_axis_points<Scalar, Dim, kCount>(1, sqrt(spread), samples.points);
    samples.weights.setConstant(Scalar(0.5) / spread);
    samples.weights[0] = static_cast<Scalar>(kappa) / spread;
    return samples;
  }
};

/// The 2 Dim points +-sqrt(Dim) e_i with equal weights: the unscented rule for kappa = 0 without its
/// weightless centre. Exact to degree 3. Reference: Arasaratnam and Haykin, "Cubature Kalman filters", 2009.
template <int Dim>
struct CubatureRule {
  static constexpr int kDim = Dim;        ///< of the points
  static constexpr int kCount = 2 * Dim;  ///< number of points

  /// The points for N(0, I), as columns, and their weights.
  template <std::floating_point Scalar>
  [[nodiscard]] WeightedSamples<Scalar, Dim, kCount> standard() const {
    using std::sqrt;
    WeightedSamples<Scalar, Dim, kCount> samples;
    detail::set_axis_points<Scalar, Dim, kCount>(0, sqrt(Scalar(Dim)), samples.points);
    samples.weights.setConstant(Scalar(0.5) / Scalar(Dim));
    return samples;
  }
};

/// 1 + 2 Dim + 2^Dim points for Dim <= 6 (15 for Dim = 3), then 2 Dim + 64 for 7, 128 up to 9, 256 up to 12
/// and 512 up to 18 dimensions: the centre, points on the axes and corners of a cube. Exact to degree 5 with
/// positive weights. Reference: Stroud, "Approximate calculation of multiple integrals", 1971 (E_n^r2 5-5),
/// with sqrt(6) e_i and sqrt(3/2) (+-1, ..., +-1).
///
/// From seven dimensions on, some of the corners do: those in which the products of up to five coordinates
/// have the mean zero, because they are the words of a linear code whose dual has the distance six (Bose,
/// 1961). With the axes at sqrt((Dim + 2)/2) and the corners at sqrt((Dim + 2)/(Dim - 2)) the centre has no
/// weight.
template <int Dim>
requires(Dim >= 2 && Dim <= 18) struct Degree5Rule {
  static constexpr int kDim = Dim;               ///< of the points
  static constexpr bool kAllCorners = Dim <= 6;  ///< of the cube, and the centre
  /// The number of signs of a corner that determine the others.
  static constexpr int kFreeSigns = kAllCorners ? Dim : Dim == 7 ? 6 : 7 + (Dim > 9) + (Dim > 12);
  static constexpr int kCorners = 1 << kFreeSigns;                ///< of the cube that are points
  static constexpr int kFirstAxis = kAllCorners ? 1 : 0;          ///< number of points at the centre
  static constexpr int kCount = kFirstAxis + 2 * Dim + kCorners;  ///< number of points

  /// The points for N(0, I), as columns, and their weights.
  template <std::floating_point Scalar>
  [[nodiscard]] WeightedSamples<Scalar, Dim, kCount> standard() const {
    using std::sqrt;
    constexpr Scalar n(Dim);
    constexpr Scalar kAxisSquare = kAllCorners ? Scalar(6) : (n + 2) / Scalar(2);
    constexpr Scalar kCornerSquare = kAllCorners ? Scalar(1.5) : (n + 2) / (n - 2);
    constexpr Scalar kAxisWeight = Scalar(1) / (kAxisSquare * kAxisSquare);
    constexpr Scalar kCornerWeight = Scalar(1) / (Scalar(kCorners) * kCornerSquare * kCornerSquare);
    const Scalar corner_entry = sqrt(kCornerSquare);
    WeightedSamples<Scalar, Dim, kCount> samples;
    if constexpr (kAllCorners) {
      samples.points.col(0).setZero();
      samples.weights[0] = Scalar(1) - Scalar(2 * Dim) * kAxisWeight - Scalar(kCorners) * kCornerWeight;
    }
    detail::set_axis_points<Scalar, Dim, kCount>(kFirstAxis, sqrt(kAxisSquare), samples.points);
    for (int k = 0; k < 2 * Dim; ++k) samples.weights[kFirstAxis + k] = kAxisWeight;
    for (int corner = 0; corner < kCorners; ++corner) {
      const int k = kFirstAxis + 2 * Dim + corner;
      for (int i = 0; i < Dim; ++i)
        samples.points(i, k) = is_negative(corner, i) ? -corner_entry : corner_entry;
      samples.weights[k] = kCornerWeight;
    }
    return samples;
  }

 private:
  /// Whether coordinate i of a corner is negative: bit i of its number; of those without a free sign, the
  /// parity of some of the others. No five of the units and these parities are linearly dependent: they are
  /// the columns of a parity check matrix of a code of distance six.
  [[nodiscard]] static constexpr bool is_negative(int corner, int i) {
    constexpr int kParities[] = {0x1f, 0x67, 0xab, 0xd5, 0x12d, 0x156, 0x1b7, 0x1db, 0x1ee};
    return i < kFreeSigns ? (corner >> i & 1) != 0
                          : std::popcount(static_cast<unsigned>(corner & kParities[i - kFreeSigns])) % 2 != 0;
  }
};

/// Dim^2 + 3 Dim + 3 points (57 for Dim = 6): the centre and, on the sphere of radius sqrt(Dim + 2), +- the
/// vertices a_k of a regular simplex and +- the projected midpoints of its edges. Exact to degree 5 with
/// positive weights for Dim <= 6. Reference: I. P. Mysovskikh, "The approximation of multiple integrals by
/// using interpolatory cubature formulae", 1980.
template <int Dim>
requires(Dim >= 2 && Dim <= 6) struct MysovskikhRule {
  static constexpr int kDim = Dim;                                 ///< of the points
  static constexpr int kVertices = Dim + 1;                        ///< of the simplex
  static constexpr int kMidpoints = Dim * (Dim + 1) / 2;           ///< of its edges
  static constexpr int kCount = 1 + 2 * (kVertices + kMidpoints);  ///< number of points

  /// The points for N(0, I), as columns, and their weights.
  template <std::floating_point Scalar>
  [[nodiscard]] WeightedSamples<Scalar, Dim, kCount> standard() const {
    using std::sqrt;
    constexpr Scalar n(Dim);
    constexpr Scalar kDenominator = (n + 1) * (n + 1) * (n + 2) * (n + 2);
    constexpr Scalar kVertexWeight = n * n * (7 - n) / (2 * kDenominator);
    constexpr Scalar kMidpointWeight = 2 * (n - 1) * (n - 1) / kDenominator;

    const Scalar radius = sqrt(n + 2);
    const Matrix<Scalar, Dim, kVertices> a = simplex<Scalar>();
    WeightedSamples<Scalar, Dim, kCount> samples;
    int count = 0;
    const auto add = [&](const Vector<Scalar, Dim>& point, Scalar weight) {
      samples.points.col(count) = point;
      samples.weights[count++] = weight;
    };
    const auto add_pair = [&](Vector<Scalar, Dim> direction, Scalar length, Scalar weight) {
      for (int i = 0; i < Dim; ++i) direction[i] = radius * (direction[i] / length);
      add(direction, weight);
      for (int i = 0; i < Dim; ++i) direction[i] = -direction[i];
      add(direction, weight);
    };
    add(Vector<Scalar, Dim>::Zero(), 2 / (n + 2));
    for (int k = 0; k < kVertices; ++k) add_pair(a.col(k), Scalar(1), kVertexWeight);
    for (int k = 0; k < kVertices; ++k) {
      for (int l = k + 1; l < kVertices; ++l) {
        Vector<Scalar, Dim> sum;
        for (int i = 0; i < Dim; ++i) sum[i] = a(i, k) + a(i, l);
        add_pair(sum, sqrt(sum.squaredNorm()), kMidpointWeight);
      }
    }
    return samples;
  }

 private:
  /// The Dim + 1 vertices of a regular simplex on the unit sphere.
  template <class Scalar>
  [[nodiscard]] static Matrix<Scalar, Dim, kVertices> simplex() {
    using std::sqrt;
    constexpr Scalar n(Dim);
    Matrix<Scalar, Dim, kVertices> a = Matrix<Scalar, Dim, kVertices>::Zero();
    for (int i = 0; i < Dim; ++i) {
      const Scalar left = n - Scalar(i);  // coordinates from i on
      a(i, i) = sqrt((n + 1) * left / (n * (left + 1)));
      for (int k = i + 1; k < kVertices; ++k) a(i, k) = -sqrt((n + 1) / (n * left * (left + 1)));
    }
    return a;
  }
};

namespace detail {

/// In place of a rule where there is none.
struct NoRule {};

template <int Dim>
[[nodiscard]] constexpr auto rule_of_degree_5() {
  if constexpr (Dim == 1) {
    return UnscentedRule<1>{};
  } else if constexpr (Dim <= 6) {
    return MysovskikhRule<Dim>{};
  } else if constexpr (Dim <= 18) {
    return Degree5Rule<Dim>{};
  } else {
    return NoRule{};
  }
}

/// The rule with the fewest points that is exact to degree 5; NoRule above 18 dimensions.
template <int Dim>
using RuleOfDegree5 = decltype(rule_of_degree_5<Dim>());

/// RuleOfDegree5, and above 18 dimensions points on the axes.
template <int Dim>
using DefaultRule = std::conditional_t<(Dim <= 18), RuleOfDegree5<Dim>, CubatureRule<Dim>>;

}  // namespace detail

}  // namespace antipode
