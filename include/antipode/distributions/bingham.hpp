// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <limits>
#include <numeric>
#include <random>
#include <utility>

#include <antipode/detail/check.hpp>
#include <antipode/detail/positive_semidefinite.hpp>
#include <antipode/detail/products.hpp>
#include <antipode/detail/symmetric_eigen.hpp>
#include <antipode/distributions/bingham_normalizer.hpp>
#include <antipode/distributions/detail/bingham_fit.hpp>
#include <antipode/distributions/detail/bingham_rejection.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/geometry/quaternion.hpp>

/// @file
/// The Bingham density of orientations.
namespace antipode {

/// How concentrated a fitted Bingham density may be.
template <std::floating_point Scalar>
struct BinghamFitOptions {
  /// Smallest second moment of a fitted density; smaller eigenvalues of the scatter are raised to it. 5e-9 is
  /// a concentration of -1e8, a rotation known to 0.008 degrees. A scatter in float resolves 1.2e-7 at best.
  Scalar min_eigenvalue = std::max(Scalar(5e-9), std::numeric_limits<Scalar>::epsilon());
};

/// The Bingham density on the unit sphere of R^Dim, 2 <= Dim <= 8; Dim = 4 are the orientations of space.
///
///     f(x) = exp(x^T M diag(z) M^T x) / N(z),   M orthogonal,   z_1 <= ... <= z_Dim = 0
///
/// f(x) = f(-x), as q and -q are the same rotation. The columns of M are the axes, the last one is the mode;
/// z are the concentrations, all zero for the uniform density. N is with respect to the surface measure of
/// the whole sphere. In the eigenbasis (coordinates M^T x) the mixed second moments vanish, and the others,
/// omega_i = E[x_i^2], ascend like z. References: C. Bingham, "An antipodally symmetric distribution on the
/// sphere", 1974; DQV-SLAM sec. III-B.
template <std::floating_point Scalar_, int Dim>
requires(Dim >= 2 && Dim <= 8) class Bingham {
 public:
  using Scalar = Scalar_;                        ///< of coordinates and densities
  static constexpr int kDim = Dim;               ///< of the space around the sphere
  using VectorType = Vector<Scalar, Dim>;        ///< a point, or one number for each axis
  using MatrixType = Matrix<Scalar, Dim>;        ///< axes, or moments of pairs of coordinates
  using FitOptions = BinghamFitOptions<Scalar>;  ///< of fit() and its like

  /// The density with the given axes (columns) and concentrations, in any order and with any shift. The axes
  /// are made exactly orthonormal. Throws unless they are orthonormal within 1e-6 and the concentrations
  /// finite and at most 1e15 apart.
  [[nodiscard]] static Bingham from_parameters(const MatrixType& axes, const VectorType& concentrations) {
    detail::require_finite("Bingham concentrations are not finite", concentrations);
    auto [M, z] = sorted(orthonormalized(axes), concentrations);
    z.array() -= z[Dim - 1];
    return {M, z, bingham_normalizer(z)};
  }

  /// exp(x^T C x) normalised; C + c I is the same density. Throws unless C is finite and symmetric.
  [[nodiscard]] static Bingham from_matrix(const MatrixType& C) {
    const auto eigen = detail::symmetric_eigen(
        detail::checked_symmetric("Bingham parameter matrix is not finite or not symmetric", C));
    return from_parameters(eigen.vectors, eigen.values);
  }

  /// The uniform density: all concentrations are zero.
  [[nodiscard]] static Bingham uniform() {
    return from_parameters(MatrixType::Identity(), VectorType::Zero());
  }

  /// The density with the scatter matrix E[x x^T] = S, which is also the maximum-likelihood fit to samples
  /// with that scatter. Throws unless S is symmetric and positive semidefinite with unit trace within 1e-6.
  [[nodiscard]] static Bingham fit(const MatrixType& S, const FitOptions& options = {}) {
    const MatrixType symmetric =
        detail::checked_symmetric("scatter matrix is not finite or not symmetric", S);
    const auto eigen = detail::symmetric_eigen<double, Dim>(symmetric.template cast<double>());
    return from_sorted_moments(eigen.vectors, eigen.values, options);
  }

  /// The density with the given axes (columns) and second moments along them, in any order. Throws unless the
  /// axes are orthonormal within 1e-6 and the moments non-negative with the sum 1 within 1e-6.
  [[nodiscard]] static Bingham from_moments(const MatrixType& axes, const VectorType& second_moments,
                                            const FitOptions& options = {}) {
    detail::require_finite("second moments are not finite", second_moments);
    const auto [M, omega] = sorted(orthonormalized(axes), second_moments);
    return from_sorted_moments(M.template cast<double>(), omega.template cast<double>(), options);
  }

  /// The density of mode * exp(phi/2), where the rotation vector phi in the axes of the child frame has the
  /// covariance Sigma [rad^2]. The vector part of exp(phi/2) then has the covariance Sigma / 4. Throws if
  /// Sigma is too wide for `mode` to be the mode (for an isotropic Sigma: above 1 rad^2).
  [[nodiscard]] static Bingham from_mode_covariance(const Vector4<Scalar>& mode, const Matrix3<Scalar>& Sigma,
                                                    const FitOptions& options = {}) requires(Dim == 4) {
    const auto eigen = detail::symmetric_eigen(
        detail::checked_symmetric("rotation covariance is not finite or not symmetric", Sigma));
    const Matrix4<Scalar> L = left_matrix(normalized_quaternion(mode));
    MatrixType axes;
    axes << L.template rightCols<3>() * eigen.vectors, L.col(0);
    const Vector3<Scalar> quarter = Scalar(0.25) * eigen.values;
    const VectorType omega(quarter[0], quarter[1], quarter[2], Scalar(1) - quarter.sum());
    if (!(omega[2] <= omega[3])) [[unlikely]] {
      detail::throw_invalid("rotation covariance is too wide for a Bingham density about the mode", Sigma);
    }
    return from_moments(axes, omega, options);
  }

  /// M, the axes as columns; their signs have no meaning.
  [[nodiscard]] const MatrixType& axes() const noexcept { return axes_; }
  /// z, ascending, the last is 0.
  [[nodiscard]] const VectorType& concentrations() const noexcept { return z_; }
  /// The last axis: f is largest at +-mode.
  [[nodiscard]] VectorType mode() const noexcept { return axes_.col(Dim - 1); }
  /// omega_i = E[x_i^2] in the eigenbasis, ascending.
  [[nodiscard]] const VectorType& second_moments() const noexcept { return normalizer_.second_moments; }
  /// log N(z), for z with the largest entry zero.
  [[nodiscard]] Scalar log_normalizer() const noexcept { return normalizer_.log_normalizer; }

  /// M diag(z) M^T.
  [[nodiscard]] MatrixType parameter_matrix() const {
    return detail::scaled_square<Scalar, Dim, Dim>(axes_, z_);
  }
  /// E[x x^T] = M diag(omega) M^T.
  [[nodiscard]] MatrixType scatter() const {
    return detail::scaled_square<Scalar, Dim, Dim>(axes_, second_moments());
  }
  /// E[x_i^2 x_j^2] in the eigenbasis, computed at every call.
  [[nodiscard]] MatrixType fourth_moments() const { return bingham_normalizer_hessian(z_).fourth_moments; }

  /// log f(x), for x of unit length (not checked).
  [[nodiscard]] Scalar log_density(const VectorType& x) const {
    return z_.dot((axes_.transpose() * x).cwiseAbs2()) - log_normalizer();
  }

  /// -E[log f], negative for a concentrated density.
  [[nodiscard]] Scalar entropy() const { return log_normalizer() - z_.dot(second_moments()); }

  /// E[log f - log g] under this density f; zero only for g = f.
  [[nodiscard]] Scalar kl_divergence(const Bingham& g) const {
    const MatrixType cosines = g.axes_.transpose() * axes_;
    const Scalar cross_entropy = g.log_normalizer() - g.z_.dot(cosines.cwiseAbs2() * second_moments());
    return std::max(Scalar(0), cross_entropy - entropy());
  }

  /// The normalised product of the two densities: Bayes' rule. Exact, the parameter matrices add. Throws if
  /// the concentrations of the product are more than 1e15 apart.
  [[nodiscard]] Bingham product(const Bingham& other) const {
    return from_matrix(parameter_matrix() + other.parameter_matrix());
  }

  /// The density of Q x. Throws unless Q is orthogonal within 1e-6.
  [[nodiscard]] Bingham transformed(const MatrixType& Q) const {
    return {orthonormalized(orthonormalized(Q) * axes_), z_, normalizer_};
  }

  /// An exact draw; its sign is random.
  template <std::uniform_random_bit_generator Rng>
  [[nodiscard]] VectorType sample(Rng& rng) const {
    const detail::BinghamRejection<Scalar, Dim> draw(-z_);
    return axes_ * draw(rng);
  }

 private:
  using Normalizer = BinghamNormalizer<Scalar, Dim>;

  Bingham(const MatrixType& axes, const VectorType& z, const Normalizer& normalizer)
      : axes_(axes), z_(z), normalizer_(normalizer) {}

  /// The nearest orthogonal matrix to an almost orthogonal one: each Newton-Schulz step squares the defect.
  [[nodiscard]] static MatrixType orthonormalized(const MatrixType& axes) {
    constexpr Scalar kTolerance = std::max(Scalar(1e-6), Scalar(32) * std::numeric_limits<Scalar>::epsilon());
    const auto defect_of = [](const MatrixType& M) -> MatrixType {
      return MatrixType::Identity() - M.transpose().lazyProduct(M);
    };
    const MatrixType defect = defect_of(axes);
    if (!axes.allFinite() || !(defect.cwiseAbs().maxCoeff() <= kTolerance)) [[unlikely]] {
      detail::throw_invalid("Bingham axes are not orthonormal", axes);
    }
    const MatrixType once = axes + Scalar(0.5) * axes.lazyProduct(defect);
    return once + Scalar(0.5) * once.lazyProduct(defect_of(once));
  }

  /// The axes and their values, the values ascending.
  [[nodiscard]] static std::pair<MatrixType, VectorType> sorted(const MatrixType& axes,
                                                                const VectorType& values) {
    std::array<int, static_cast<std::size_t>(Dim)> order;
    std::iota(order.begin(), order.end(), 0);
    std::sort(order.begin(), order.end(),
              [&](int i, int j) { return values[i] < values[j] || (values[i] == values[j] && i < j); });
    std::pair<MatrixType, VectorType> result;
    for (int i = 0; i < Dim; ++i) {
      result.first.col(i) = axes.col(order[static_cast<std::size_t>(i)]);
      result.second[i] = values[order[static_cast<std::size_t>(i)]];
    }
    return result;
  }

  [[nodiscard]] static Bingham from_sorted_moments(const Matrix<double, Dim>& axes,
                                                   const Vector<double, Dim>& second_moments,
                                                   const FitOptions& options) {
    const auto solution = detail::solve_bingham_moments(admissible_moments(second_moments, options));
    return {axes.template cast<Scalar>(),
            solution.z.template cast<Scalar>(),
            {static_cast<Scalar>(solution.log_normalizer), solution.second_moments.template cast<Scalar>()}};
  }

  /// The moments with those below min_eigenvalue raised to it, divided by their sum. Throws unless they can
  /// be the eigenvalues of a scatter matrix.
  [[nodiscard]] static Vector<double, Dim> admissible_moments(const Vector<double, Dim>& moments,
                                                              const FitOptions& options) {
    constexpr double kEpsilon = static_cast<double>(std::numeric_limits<Scalar>::epsilon());
    constexpr double kTraceTolerance = std::max(1e-6, 32 * kEpsilon);
    constexpr double kNegativeTolerance = std::max(1e-12, 32 * kEpsilon);
    constexpr double kSmallestSolvable = 1e-15;
    if (!(options.min_eigenvalue >= Scalar(0) && options.min_eigenvalue <= Scalar(1) / Dim)) [[unlikely]] {
      detail::throw_invalid("min_eigenvalue is not in [0, 1/Dim]", options.min_eigenvalue);
    }
    if (!(std::abs(moments.sum() - 1.0) <= kTraceTolerance)) [[unlikely]] {
      detail::throw_invalid("second moments (eigenvalues of the scatter matrix) do not sum to one", moments);
    }
    if (!(moments.minCoeff() >= -kNegativeTolerance)) [[unlikely]] {
      detail::throw_invalid("a second moment (eigenvalue of the scatter matrix) is negative", moments);
    }
    const Vector<double, Dim> raised = moments.cwiseMax(static_cast<double>(options.min_eigenvalue));
    if (!(raised.minCoeff() >= kSmallestSolvable)) [[unlikely]] {
      detail::throw_invalid("scatter matrix is singular and min_eigenvalue does not bound it, moments",
                            moments);
    }
    return raised / raised.sum();
  }

  MatrixType axes_;
  VectorType z_;
  Normalizer normalizer_;
};

/// The density of a q for a constant rotation a: a change of the parent frame. Exact.
template <std::floating_point Scalar>
[[nodiscard]] Bingham<Scalar, 4> compose(const Vector4<Scalar>& a, const Bingham<Scalar, 4>& q) {
  return q.transformed(left_matrix(a));
}

/// The density of q b for a constant rotation b: a change of the child frame. Exact.
template <std::floating_point Scalar>
[[nodiscard]] Bingham<Scalar, 4> compose(const Bingham<Scalar, 4>& q, const Vector4<Scalar>& b) {
  return q.transformed(right_matrix(b));
}

/// The Bingham density with the moments of a b, for independent rotations a and b. Its scatter matrix is
/// exact (linear in either scatter). That a b has a Bingham density is an approximation (DQV-SLAM eq. 11).
template <std::floating_point Scalar>
[[nodiscard]] Bingham<Scalar, 4> compose(const Bingham<Scalar, 4>& a, const Bingham<Scalar, 4>& b,
                                         const BinghamFitOptions<Scalar>& options = {}) {
  const Matrix4<Scalar> S_b = b.scatter();
  Matrix4<Scalar> scatter = Matrix4<Scalar>::Zero();
  for (int i = 0; i < 4; ++i) {
    scatter += a.second_moments()[i] * detail::congruence<Scalar, 4, 4>(left_matrix(a.axes().col(i)), S_b);
  }
  return Bingham<Scalar, 4>::fit(scatter, options);
}

}  // namespace antipode
