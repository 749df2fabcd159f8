// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <random>
#include <stdexcept>
#include <type_traits>
#include <utility>
#include <vector>

#include <antipode/detail/check.hpp>
#include <antipode/distributions/detail/gaussian_box.hpp>
#include <antipode/distributions/detail/tangent_chart.hpp>
#include <antipode/distributions/mixture.hpp>
#include <antipode/distributions/projected_gaussian.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/geometry/dual_quaternion.hpp>
#include <antipode/geometry/quaternion.hpp>

/// @file
/// The probability that a pose lies in a box, and the best place for the box: the grasp criterion of MPG
/// sec. V.
namespace antipode {

/// A set of small motions e: lower <= (2 u, t) <= upper, with u the tangent coordinates of e at the identity
/// and t its translation [m]. 2 u = 2 tan(angle/2) axis, a rotation vector [rad] to second order.
template <std::floating_point Scalar>
struct PoseBox {
  Vector6<Scalar> lower,  ///< limits of (2 u, t): rad, m
      upper;              ///< limits of (2 u, t): rad, m

  /// The box of at most these errors, on either side.
  [[nodiscard]] static PoseBox symmetric(const Vector6<Scalar>& half_extents) {
    return {-half_extents, half_extents};
  }

  /// Whether the small motion e is in the box, its limits included.
  [[nodiscard]] bool contains(const DualQuaternion<Scalar>& e) const {
    const Vector4<Scalar> q = canonical(e.rotation());
    const Vector3<Scalar> t = e.translation();
    for (int i = 0; i < 3; ++i) {
      const Scalar turn = Scalar(2) * q[i + 1];
      if (!(turn >= lower[i] * q[0] && turn <= upper[i] * q[0])) return false;
      if (!(t[i] >= lower[i + 3] && t[i] <= upper[i + 3])) return false;
    }
    return true;
  }
};

/// A probability with its standard error.
template <class Scalar>
struct Probability {
  Scalar value;           ///< from 0 to 1
  Scalar standard_error;  ///< of the value
};

/// The probability that m^-1 x lies in the box, estimated from draws of x, the columns [q; p]. Throws if
/// there are none.
template <class Poses, class Scalar = typename Poses::Scalar>
requires(Poses::RowsAtCompileTime == 8)
    [[nodiscard]] Probability<Scalar> box_probability(const Eigen::MatrixBase<Poses>& draws,
                                                      const DualQuaternion<Scalar>& m,
                                                      const PoseBox<Scalar>& box) {
  using std::sqrt;
  if (draws.cols() == 0) [[unlikely]] {
    detail::throw_invalid("the probability of a box needs draws, number", draws.cols());
  }
  const DualQuaternion<Scalar> to_box = m.inverse();
  Eigen::Index inside = 0;
  for (Eigen::Index k = 0; k < draws.cols(); ++k) {
    inside += box.contains(to_box * DualQuaternion<Scalar>::unchecked(draws.col(k))) ? 1 : 0;
  }
  const Scalar p = Scalar(inside) / Scalar(draws.cols());
  return {p, sqrt(p * (Scalar(1) - p) / Scalar(draws.cols()))};
}

/// The probability of lower <= (u, t) <= upper in the tangent coordinates of the density; limits may be
/// infinite. Deterministic; its standard error is 1e-5 to 1e-3, and more if the rotation is uncertain by a
/// radian. Throws std::domain_error if the covariance is singular.
template <std::floating_point Scalar, Projection kProjection>
[[nodiscard]] Probability<Scalar> tangent_box_probability(
    const BasicProjectedGaussian<Scalar, kProjection>& x, const std::type_identity_t<Vector6<Scalar>>& lower,
    const std::type_identity_t<Vector6<Scalar>>& upper) {
  if (!x.positive_definite()) [[unlikely]] {
    throw std::domain_error("a projected Gaussian with a singular covariance has no box probabilities");
  }
  const auto weight = [](const Vector6<double>& y) {
    const double stretch = 1.0 + y.head<3>().squaredNorm();
    return kProjection == Projection::kRenormalized ? 1.0 / (stretch * stretch) : 1.0;
  };
  const auto inside = detail::gaussian_box_probability<6>(
      x.mean().template cast<double>(), x.sqrt_factor().template cast<double>(),
      lower.template cast<double>(), upper.template cast<double>(), weight);
  const double mass = kProjection == Projection::kRenormalized ? x.hemisphere_mass() : 1.0;
  return {static_cast<Scalar>(inside.probability / mass), static_cast<Scalar>(inside.standard_error / mass)};
}

/// How long best_grasp searches.
struct GraspOptions {
  int draws = 4000;     ///< for the search; as many new ones give the probability of the result
  int starts = 3;       ///< searches, from the most probable of the components' modes
  int refinements = 6;  ///< halvings of the step, which is a quarter of the box at first
};

/// The result of best_grasp.
template <class Scalar>
struct Grasp {
  DualQuaternion<Scalar> pose;      ///< m, the best place of the box found
  Probability<Scalar> probability;  ///< that m^-1 x lies in the box, from new draws
  int evaluations;                  ///< places that were tried
};

namespace detail {

/// n draws as columns [q; p].
template <class Density, class Rng>
[[nodiscard]] auto draw_poses(const Density& x, int n, Rng& rng) {
  Matrix<typename Density::Scalar, 8, Eigen::Dynamic> draws(8, n);
  for (int k = 0; k < n; ++k) draws.col(k) = x.sample(rng).coeffs();
  return draws;
}

}  // namespace detail

/// arg max over m of the probability that x lies in m(B): where to reach for an object whose pose x is known
/// by a mixture, with a gripper that tolerates the errors in the box B.
///
/// Every m is judged by the same draws. From each start the search goes along the six axes of m, in both
/// directions, with a step that is halved when no direction improves. Throws unless there are draws and
/// starts and the box is finite with a positive volume.
template <class Component, std::uniform_random_bit_generator Rng>
[[nodiscard]] Grasp<typename Component::Scalar> best_grasp(const Mixture<Component>& x,
                                                           const PoseBox<typename Component::Scalar>& box,
                                                           Rng& rng, const GraspOptions& options = {}) {
  using Scalar = typename Component::Scalar;
  using Pose = DualQuaternion<Scalar>;
  if (options.draws < 1 || options.starts < 1) [[unlikely]] {
    detail::throw_invalid("a search for a grasp needs draws and starts, fewest",
                          std::min(options.draws, options.starts));
  }
  const Vector6<Scalar> size = box.upper - box.lower;
  if (!size.allFinite() || !(size.minCoeff() > Scalar(0))) [[unlikely]] {
    detail::throw_invalid("the box of a grasp is not finite with a positive volume, its size", size);
  }
  const auto draws = detail::draw_poses(x, options.draws, rng);
  int evaluations = 0;
  const auto score = [&](const Pose& m) {
    ++evaluations;
    return box_probability(draws, m, box).value;
  };

  std::vector<std::pair<Scalar, Pose>> candidates;
  for (const auto& element : x) {
    const Pose m = element.density.pose();
    candidates.emplace_back(score(m), m);
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  candidates.resize(std::min(candidates.size(), static_cast<std::size_t>(options.starts)));

  const Vector6<Scalar> quarter = Scalar(0.25) * size;
  for (auto& [best, m] : candidates) {
    Scalar scale(1);
    for (int refinement = 0; refinement < options.refinements;) {
      bool improved = false;
      for (int i = 0; i < 12; ++i) {
        const Vector6<Scalar> xi = Vector6<Scalar>::Unit(i / 2) * ((i % 2 ? -scale : scale) * quarter[i / 2]);
        const Pose moved = m.boxplus(xi).renormalized();
        if (const Scalar value = score(moved); value > best) {
          best = value;
          m = moved;
          improved = true;
        }
      }
      if (!improved) {
        scale *= Scalar(0.5);
        ++refinement;
      }
    }
  }
  const Pose m = std::max_element(candidates.begin(), candidates.end(), [](const auto& a, const auto& b) {
                   return a.first < b.first;
                 })->second;
  return {m, box_probability(detail::draw_poses(x, options.draws, rng), m, box), evaluations};
}

}  // namespace antipode
