// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>
#include <limits>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include <antipode/detail/check.hpp>
#include <antipode/detail/cholesky.hpp>
#include <antipode/distributions/density.hpp>
#include <antipode/distributions/gaussian.hpp>
#include <antipode/distributions/mixture.hpp>
#include <antipode/distributions/projected_gaussian.hpp>
#include <antipode/distributions/projected_gaussian_conversions.hpp>
#include <antipode/distributions/projected_orientation.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/geometry/dual_quaternion.hpp>

/// @file
/// Marginals and mode of a mixture of projected Gaussians, and values of any pose density on a path or a
/// grid.
namespace antipode {

namespace detail {

template <class Scalar, Projection kProjection>
using ProjectedMixture = Mixture<BasicProjectedGaussian<Scalar, kProjection>>;

}  // namespace detail

/// The exact marginal density of the orientation.
template <std::floating_point Scalar, Projection kProjection>
[[nodiscard]] Mixture<ProjectedOrientation<Scalar, kProjection>> orientation_marginal(
    const detail::ProjectedMixture<Scalar, kProjection>& x) {
  std::vector<typename Mixture<ProjectedOrientation<Scalar, kProjection>>::Element> elements;
  elements.reserve(x.size());
  for (const auto& [weight, density] : x) {
    elements.push_back({weight, ProjectedOrientation<Scalar, kProjection>(density)});
  }
  return Mixture<ProjectedOrientation<Scalar, kProjection>>::normalized(std::move(elements));
}

/// The marginal density of the translation [m] in the parent frame. Exact for push-forward components, and
/// for renormalised ones whose translation is not correlated with the rotation. Otherwise each component has
/// the right mean and covariance.
template <std::floating_point Scalar, Projection kProjection>
[[nodiscard]] Mixture<Gaussian<Scalar, 3>> translation_marginal(
    const detail::ProjectedMixture<Scalar, kProjection>& x) {
  std::vector<typename Mixture<Gaussian<Scalar, 3>>::Element> elements;
  elements.reserve(x.size());
  const auto add = [&](Scalar weight, const PushForwardGaussian<Scalar>& y) {
    elements.push_back({weight, Gaussian<Scalar, 3>(y.mean().template tail<3>(),
                                                    y.covariance().template bottomRightCorner<3, 3>())});
  };
  for (const auto& [weight, density] : x) {
    if constexpr (kProjection == Projection::kRenormalized) {
      add(weight, match_push_forward(density));
    } else {
      add(weight, density);
    }
  }
  return Mixture<Gaussian<Scalar, 3>>::normalized(std::move(elements));
}

/// The highest peak of a mixture.
template <class Scalar>
struct MixtureMode {
  DualQuaternion<Scalar> pose;  ///< where it is
  Scalar log_density;           ///< of the mixture, there
  int iterations;               ///< steps uphill to it
};

namespace detail {

/// One step of ascent from a pose, in its tangent space (u, t): to the maximum of a quadratic model of the
/// log density. Its curvature is sum_i r_i J_i^T Lambda_i J_i, with the responsibilities r_i and the inverse
/// covariances Lambda_i of the components.
template <class Scalar, Projection kProjection>
[[nodiscard]] Vector6<Scalar> ascent_step(const ProjectedMixture<Scalar, kProjection>& x,
                                          const DualQuaternion<Scalar>& pose, Scalar log_density) {
  using std::abs;
  using std::exp;
  constexpr Scalar kFar = Scalar(0.1);  // components with |q.q0| below this are left out
  Vector6<Scalar> slope = Vector6<Scalar>::Zero();
  Matrix6<Scalar> curvature = Matrix6<Scalar>::Zero();
  const Vector4<Scalar> q = pose.rotation();
  for (const auto& [weight, density] : x) {
    if (!(abs(q.dot(density.tangent_point())) > kFar)) continue;
    const Scalar responsibility = weight * exp(density.log_density(pose) - log_density);
    if (!(responsibility > Scalar(1e-12))) continue;
    Matrix6<Scalar> J = Matrix6<Scalar>::Identity();
    J.template topLeftCorner<3, 3>() =
        ChartChange<Scalar>(q, density.tangent_point()).jacobian(Vector3<Scalar>::Zero());
    const Vector6<Scalar> y = density.coordinates(pose);
    const Matrix6<Scalar> whitened_J = solve_lower<Scalar, 6, 6>(density.sqrt_factor(), J);
    const Vector6<Scalar> whitened_y = solve_lower<Scalar, 6, 1>(density.sqrt_factor(), y - density.mean());
    slope -= responsibility * (whitened_J.transpose() * whitened_y);
    curvature += responsibility * (whitened_J.transpose() * whitened_J);
    if constexpr (kProjection == Projection::kPushForward) {
      const Vector3<Scalar> u = y.template head<3>();
      slope.template head<3>() += responsibility * Scalar(4) / (Scalar(1) + u.squaredNorm()) *
                                  (J.template topLeftCorner<3, 3>().transpose() * u);
    }
  }
  return solve_positive_definite(curvature, slope);
}

}  // namespace detail

/// The pose of largest density: the highest of the local maxima that ascent from the components' modes finds.
/// Throws std::domain_error if a component has a singular covariance.
template <std::floating_point Scalar, Projection kProjection>
[[nodiscard]] MixtureMode<Scalar> mode(const detail::ProjectedMixture<Scalar, kProjection>& x) {
  using Pose = DualQuaternion<Scalar>;
  constexpr int kMaxIterations = 100;
  MixtureMode<Scalar> best{Pose::identity(), -std::numeric_limits<Scalar>::infinity(), 0};
  for (const auto& element : x) {
    MixtureMode<Scalar> peak{element.density.pose(), Scalar(0), 0};
    peak.log_density = x.log_density(peak.pose);
    for (bool rising = true; rising && peak.iterations < kMaxIterations; ++peak.iterations) {
      Vector6<Scalar> step = detail::ascent_step(x, peak.pose, peak.log_density);
      rising = false;
      for (int halving = 0; halving < 20 && !rising; ++halving, step *= Scalar(0.5)) {
        const Pose pose = Pose::from_rotation_translation(
            detail::central_projection<Scalar>(peak.pose.rotation(), step.template head<3>()),
            peak.pose.translation() + step.template tail<3>());
        const Scalar log_density = x.log_density(pose);
        if (log_density > peak.log_density) {
          rising = true;
          peak.pose = pose;
          peak.log_density = log_density;
        }
      }
    }
    if (peak.log_density > best.log_density) best = peak;
  }
  return best;
}

/// log p of every column [q; p], which must be unit (not checked).
template <class D, class Poses>
requires(Poses::RowsAtCompileTime == 8 && Density<D, DualQuaternion<typename Poses::Scalar>>)
    [[nodiscard]] Vector<typename Poses::Scalar, Eigen::Dynamic> log_density_of(
        const D& density, const Eigen::MatrixBase<Poses>& poses) {
  using Scalar = typename Poses::Scalar;
  Vector<Scalar, Eigen::Dynamic> values(poses.cols());
  for (Eigen::Index k = 0; k < poses.cols(); ++k) {
    values[k] = density.log_density(DualQuaternion<Scalar>::unchecked(poses.col(k)));
  }
  return values;
}

/// log p at `count` poses evenly spaced on the screw motion between two, both included. Throws unless
/// count >= 2.
template <class D, class Scalar = typename D::Scalar>
requires Density<D, DualQuaternion<Scalar>>
[[nodiscard]] Vector<Scalar, Eigen::Dynamic> log_density_on_path(const D& density,
                                                                 const DualQuaternion<Scalar>& from,
                                                                 const DualQuaternion<Scalar>& to,
                                                                 int count) {
  if (count < 2) [[unlikely]] {
    detail::throw_invalid("a path needs two points or more, count", count);
  }
  const Vector6<Scalar> screw = to.boxminus(from);
  Vector<Scalar, Eigen::Dynamic> values(count);
  for (int k = 0; k < count; ++k) {
    const Vector6<Scalar> xi = Scalar(k) / Scalar(count - 1) * screw;
    values[k] = density.log_density(from.boxplus(xi));
  }
  return values;
}

/// The poses center exp(a xi_a + b xi_b), a and b evenly spaced in [-1, 1].
template <class Scalar>
struct PoseGrid {
  DualQuaternion<Scalar> center;  ///< the pose at a = b = 0
  Vector6<Scalar> xi_a,           ///< twist from the centre to a = 1, rotation first
      xi_b;                       ///< twist from the centre to b = 1, rotation first
  int rows,                       ///< values of a, two or more
      cols;                       ///< values of b, two or more
};

/// log p on a grid: the rows belong to a, the columns to b. Throws unless there are two or more of both.
template <class D, class Scalar = typename D::Scalar>
requires Density<D, DualQuaternion<Scalar>>
[[nodiscard]] Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic> log_density_on_grid(
    const D& density, const PoseGrid<Scalar>& grid) {
  if (grid.rows < 2 || grid.cols < 2) [[unlikely]] {
    detail::throw_invalid("a grid needs two rows and columns or more, fewest",
                          std::min(grid.rows, grid.cols));
  }
  const auto spaced = [](int k, int count) { return Scalar(2 * k) / Scalar(count - 1) - Scalar(1); };
  Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic> values(grid.rows, grid.cols);
  for (int j = 0; j < grid.cols; ++j) {
    for (int i = 0; i < grid.rows; ++i) {
      const Vector6<Scalar> xi = spaced(i, grid.rows) * grid.xi_a + spaced(j, grid.cols) * grid.xi_b;
      values(i, j) = density.log_density(grid.center.boxplus(xi));
    }
  }
  return values;
}

}  // namespace antipode
