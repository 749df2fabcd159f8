// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>
#include <utility>

#include <antipode/eigen_types.hpp>
#include <antipode/geometry/dual_quaternion.hpp>
#include <antipode/weighted_samples.hpp>

/// What the algorithms ask of the types they are given. A concept can check names and signatures; the laws
/// beside it are part of the requirement all the same, and the tests of this library check them for its own
/// types.
namespace antipode {

/// Tangent vectors of a manifold: the type of the difference of two of its points.
template <class M>
using Tangent = decltype(std::declval<const M&>().boxminus(std::declval<const M&>()));

/// A smooth space whose points differ by vectors of fixed length.
///
/// Laws, for points x, y and small vectors a (inside the injectivity radius):
///   x.boxplus(0) = x;   x.boxplus(y.boxminus(x)) = y;   x.boxplus(a).boxminus(x) = a;
///   boxplus is smooth in both arguments. "=" means: equal as points, not as numbers (q and -q are one
///   rotation).
template <class M>
concept Manifold = std::copyable<M> && requires(const M& x, const M& y, const Tangent<M>& a) {
  typename M::Scalar;
  { x.boxplus(a) } -> std::convertible_to<M>;
  { x.boxminus(y) } -> std::same_as<Tangent<M>>;
  requires Tangent<M>::RowsAtCompileTime >
  0;
};

/// A manifold that is a group, perturbed on the right.
///
/// Laws: (x y) z = x (y z);   x identity() = identity() x = x;   x x.inverse() = identity();
///   exp(log(x)) = x, and log(exp(a)) = a inside the injectivity radius;   x.boxplus(a) = x exp(a);
///   x exp(a) x.inverse() = exp(x.adjoint() a).
template <class G>
concept LieGroup = Manifold<G> && requires(const G& x, const G& y, const Tangent<G>& a) {
  { G::identity() } -> std::convertible_to<G>;
  { x* y } -> std::convertible_to<G>;
  { x.inverse() } -> std::convertible_to<G>;
  { G::exp(a) } -> std::convertible_to<G>;
  { x.log() } -> std::convertible_to<Tangent<G>>;
  { x.adjoint() * a } -> std::convertible_to<Tangent<G>>;
};

/// A probability density over points of type Point, known by its logarithm.
///
/// Laws: exp(log_density) integrates to one over the whole space, with respect to the measure the class
/// documents;
///   two points that stand for the same thing (q and -q) have the same density, bit for bit.
template <class D, class Point>
concept Density = requires(const D& density, const Point& x) {
  typename D::Scalar;
  { density.log_density(x) } -> std::convertible_to<typename D::Scalar>;
};

/// A deterministic way to replace a density by Rule::kCount weighted points.
///
/// Laws: the weights are non-negative and sum to one; the points have the mean and the covariance of the
/// density, on a
///   sphere its scatter matrix, up to rounding; nothing is allocated; equal arguments give equal points, bit
///   for bit.
template <class Rule, class D>
concept SigmaPointRule = requires(const Rule& rule, const D& density) {
  { Rule::kCount } -> std::convertible_to<int>;
  requires decltype(sample(rule, density))::kCount == Rule::kCount;
  { sample(rule, density).weights } -> std::convertible_to<Vector<typename D::Scalar, Rule::kCount>>;
};

/// A sigma point rule for pose densities: its points are the columns [q; p] of 8 x kCount.
template <class Rule, class D>
concept PoseRule = SigmaPointRule<Rule, D> &&
    (decltype(sample(std::declval<const Rule&>(), std::declval<const D&>()))::kDim == 8);

/// The log-likelihood of a fixed measurement, asked for one pose at a time: Scalar(pose).
///
/// Laws: a pure function; the same for x and -x; constants that do not depend on the pose may be left out
/// (then they
///   are missing from the evidence, too). A pose that cannot explain the measurement at all, a landmark
///   behind the camera say, has a very negative finite value or -infinity; never NaN, never +infinity.
template <class L, class Scalar>
concept PoseLogLikelihood = requires(L& log_likelihood, const DualQuaternion<Scalar>& pose) {
  { log_likelihood(pose) } -> std::convertible_to<Scalar>;
};

/// The same for `Count` poses in one call, void(poses, values): 8 x Count columns [q; p] in, one value each
/// out. Worth its while when work can be shared between the poses. An Eigen::Ref of dynamic size accepts
/// every Count.
template <class L, class Scalar, int Count>
concept BatchedPoseLogLikelihood = requires(L& log_likelihood, const Matrix<Scalar, 8, Count>& poses,
                                            Vector<Scalar, Count>& values) {
  log_likelihood(poses, values);
};

/// A log-likelihood of poses in either form.
template <class L, class Scalar, int Count>
concept LogLikelihood = PoseLogLikelihood<L, Scalar> || BatchedPoseLogLikelihood<L, Scalar, Count>;

/// The log-likelihood of every column of `poses`, through whichever form the callable has.
template <class Scalar, int Count, LogLikelihood<Scalar, Count> L>
void evaluate_log_likelihood(L& log_likelihood, const Matrix<Scalar, 8, Count>& poses,
                             Vector<Scalar, Count>& values) {
  if constexpr (BatchedPoseLogLikelihood<L, Scalar, Count>) {
    log_likelihood(poses, values);
  } else {
    for (int k = 0; k < Count; ++k) {
      values[k] = log_likelihood(DualQuaternion<Scalar>::unchecked(poses.col(k)));
    }
  }
}

}  // namespace antipode
