// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>

#include <antipode/distributions/state_gaussian.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/geometry/dual_quaternion.hpp>

/// @file
/// The call signatures of a log-likelihood of poses.
namespace antipode {

/// The log-likelihood of a fixed measurement, asked for one pose at a time: Scalar(pose).
///
/// Laws:
/// - it is a pure function, the same for x and -x;
/// - constants that do not depend on the pose may be left out; then they are missing from the evidence, too;
/// - a pose that cannot explain the measurement at all, a landmark behind the camera say, has a very negative
///   finite value or -infinity; never NaN, never +infinity.
template <class L, class Scalar>
concept PoseLogLikelihood = requires(L& log_likelihood, const DualQuaternion<Scalar>& pose) {
  { log_likelihood(pose) } -> std::convertible_to<Scalar>;
};

/// The same for `Count` poses in one call, void(poses, values): 8 x Count columns [q; p] in, one value each
/// out. Useful if the poses can share work. An Eigen::Ref of dynamic size accepts every Count.
template <class L, class Scalar, int Count>
concept BatchedPoseLogLikelihood = requires(L& log_likelihood, const Matrix<Scalar, 8, Count>& poses,
                                            Vector<Scalar, Count>& values) {
  log_likelihood(poses, values);
};

/// A log-likelihood of poses in either form.
template <class L, class Scalar, int Count>
concept LogLikelihood = PoseLogLikelihood<L, Scalar> || BatchedPoseLogLikelihood<L, Scalar, Count>;

namespace detail {

/// The log-likelihood at `count` poses [q; p], one call for each. A single function for any count, so that
/// the compiler may inline the likelihood.
template <class Scalar, class L>
void evaluate_each(L& log_likelihood, const Scalar* poses, int count, Scalar* values) {
  for (int k = 0; k < count; ++k) {
    values[k] =
        log_likelihood(DualQuaternion<Scalar>::unchecked(Eigen::Map<const Vector<Scalar, 8>>(poses + 8 * k)));
  }
}

}  // namespace detail

/// The log-likelihood of every column of `poses`, through whichever form the callable has.
template <class Scalar, int Count, LogLikelihood<Scalar, Count> L>
void evaluate_log_likelihood(L& log_likelihood, const Matrix<Scalar, 8, Count>& poses,
                             Vector<Scalar, Count>& values) {
  if constexpr (BatchedPoseLogLikelihood<L, Scalar, Count>) {
    log_likelihood(poses, values);
  } else {
    detail::evaluate_each(log_likelihood, poses.data(), Count, values.data());
  }
}

/// A log-likelihood of the states of a concentrated density: Scalar(state). If the states are poses, the form
/// for `Count` poses is also accepted.
template <class L, class Density, int Count>
concept LogLikelihoodOver = requires(L& log_likelihood, const typename Density::Chart::Point& state) {
  { log_likelihood(state) } -> std::convertible_to<typename Density::Scalar>;
}
|| (std::same_as<typename Density::Chart::Point, DualQuaternion<typename Density::Scalar>> &&
    BatchedPoseLogLikelihood<L, typename Density::Scalar, Count>);

}  // namespace antipode
