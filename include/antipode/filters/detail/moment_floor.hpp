// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <limits>

#include <antipode/distributions/bingham_gaussian.hpp>
#include <antipode/eigen_types.hpp>

/// How small the second moments of an orientation may become in a progression.
namespace antipode::detail {

inline constexpr double kLeastFloor = 1e-15;  ///< least ProgressiveOptions::min_eigenvalue

/// The smallest second moment that the orientation may have on the way from a prior. A moment that the prior
/// has below it, of an axis that is known, stays: it does not tell that the samples are too few.
template <class Scalar>
class MomentFloor {
 public:
  MomentFloor(const BinghamGaussian<Scalar>& prior, Scalar min_eigenvalue)
      : value_(std::min(min_eigenvalue, std::max(prior.orientation().second_moments()[0], kRounding))),
        known_axes_(count(prior, Scalar(2) * value_)) {}

  [[nodiscard]] Scalar value() const noexcept { return value_; }

  /// Whether more axes than the prior's known ones are at the floor.
  [[nodiscard]] bool reached_by(const BinghamGaussian<Scalar>& density) const {
    return count(density, Scalar(1 + 1e-5) * value_) > known_axes_;
  }

  /// Whether the step was too long for the samples: the orientation is at its floor for the second time, or
  /// one of its moments shrank a thousandfold at once.
  [[nodiscard]] bool degenerates(const BinghamGaussian<Scalar>& before,
                                 const BinghamGaussian<Scalar>& after) const {
    constexpr Scalar kMaxShrinkage = Scalar(1e3);
    const auto shrinkage =
        before.orientation().second_moments().array() / after.orientation().second_moments().array();
    return (shrinkage > kMaxShrinkage).any() || (reached_by(before) && reached_by(after));
  }

 private:
  static constexpr Scalar kRounding =
      std::max(Scalar(kLeastFloor), std::numeric_limits<Scalar>::epsilon());  // of a moment

  [[nodiscard]] static Eigen::Index count(const BinghamGaussian<Scalar>& density, Scalar limit) {
    return (density.orientation().second_moments().array() <= limit).count();
  }

  Scalar value_;
  Eigen::Index known_axes_;
};

}  // namespace antipode::detail
