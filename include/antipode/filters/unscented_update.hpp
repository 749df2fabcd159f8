// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <concepts>
#include <optional>

#include <antipode/cubature/gaussian_rules.hpp>
#include <antipode/detail/check.hpp>
#include <antipode/detail/cholesky.hpp>
#include <antipode/detail/positive_semidefinite.hpp>
#include <antipode/detail/products.hpp>
#include <antipode/distributions/gaussian.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/filters/detail/statistical_regression.hpp>
#include <antipode/filters/noisy_measurement.hpp>
#include <antipode/geometry/dual_quaternion.hpp>
#include <antipode/weighted_samples.hpp>

/// @file
/// Unscented filtering of a vector x, a landmark say, that is measured from a pose: z = h(pose, x) + v,
/// v ~ N(0, R).
///
/// The pose is either known, a DualQuaternion, or a density, given by samples of it (sample(rule, density));
/// then all pairs of a pose and a sigma point of x are used. A model that cannot measure for some pair (the
/// landmark is behind the camera) returns an empty optional.
namespace antipode {

/// h(pose, x): a vector of fixed size, or a std::optional of it.
template <class Model, class Scalar, int Dim>
concept MeasurementModel = requires(const Model& h, const DualQuaternion<Scalar>& pose,
                                    const Vector<Scalar, Dim>& x) {
  { h(pose, x) } -> std::convertible_to<std::optional<detail::MeasurementOf<Model, Scalar, Dim>>>;
};

/// A known pose or samples of a density of poses.
template <class Poses, class Scalar>
concept PoseOrSamples = requires(const Poses& poses) {
  { detail::pose_samples(poses).weights[0] } -> std::convertible_to<Scalar>;
  requires std::same_as<typename Poses::Scalar, Scalar>;
};

/// Mean and covariance of a measurement to be made, without its noise.
template <class Scalar, int Measured>
struct PredictedMeasurement {
  Vector<Scalar, Measured> mean;        ///< of h
  Matrix<Scalar, Measured> covariance;  ///< of h; that of the noise is to be added
};

/// The unscented transform of x through h (DQV-SLAM Alg. 3 for a known pose); nothing if h cannot measure for
/// some pair.
///
/// A gate needs samples of the pose's density, and R added to the covariance. The covariance for a known
/// pose, as in the paper, is right inside a likelihood of the pose but too small for a gate.
template <std::floating_point Scalar, int Dim, PoseOrSamples<Scalar> Poses,
          MeasurementModel<Scalar, Dim> Model>
[[nodiscard]] auto project_gaussian(const Gaussian<Scalar, Dim>& x, const Poses& poses, const Model& h,
                                    double kappa = 0.0) {
  using Projected =
      PredictedMeasurement<Scalar, detail::MeasurementOf<Model, Scalar, Dim>::RowsAtCompileTime>;
  const auto model = detail::regress(h, detail::pose_samples(poses), x.mean(), x.sqrt_factor(),
                                     UnscentedRule<Dim>{kappa}.template standard<Scalar>());
  return model ? std::optional<Projected>({model->mean, model->covariance()}) : std::nullopt;
}

/// The sigma points of unscented_update, and how often they are used.
struct UnscentedUpdateOptions {
  /// Of UnscentedRule. For a vector of three, 0 gives each coordinate the fourth moment of a Gaussian, 3.
  double kappa = 0.0;
  /// Number of regressions. 1 is Alg. 4; more repeat the regression over the posterior (iterated posterior
  /// linearisation). For a prior that is wide compared to the curvature of h, 2 or 3 suffice.
  int iterations = 2;
};

/// Whether unscented_update could use the measurement.
enum class UnscentedUpdateStatus {
  kUpdated,        ///< the posterior is the updated density
  kNotObservable,  ///< h cannot measure at some sigma point of the prior, or its value there is not
                   ///< finite or too large to compute with. The posterior is the prior
};

/// The result of unscented_update. All but the posterior refers to the prior, for gating and for the log of a
/// filter.
template <std::floating_point Scalar, int Dim, int Measured>
struct UnscentedUpdateResult {
  Gaussian<Scalar, Dim> posterior;  ///< the prior, if the measurement could not be used
  UnscentedUpdateStatus status = UnscentedUpdateStatus::kNotObservable;  ///< whether it was used
  int iterations = 0;  ///< done; fewer than asked for if h could not measure around an intermediate result
  Vector<Scalar, Measured> innovation = Vector<Scalar, Measured>::Zero();                  ///< z - E[z]
  Matrix<Scalar, Measured> innovation_covariance = Matrix<Scalar, Measured>::Zero();       ///< S = Cov(z)
  Matrix<Scalar, Dim, Measured> cross_covariance = Matrix<Scalar, Dim, Measured>::Zero();  ///< Cov(x, z)
  Matrix<Scalar, Dim, Measured> gain = Matrix<Scalar, Dim, Measured>::Zero();              ///< Cov(x, z) S^-1
  /// Normalised innovation squared: chi-square of the measurement's dimension if the model is correct.
  Scalar nis = Scalar(0);
};

namespace detail {

/// R, symmetric. Throws unless z is finite and R positive definite.
template <std::floating_point Scalar, int Measured>
[[nodiscard]] Matrix<Scalar, Measured> checked_noise(const NoisyMeasurement<Scalar, Measured>& measurement) {
  require_finite("measurement is not finite", measurement.z);
  auto R = checked_covariance("measurement noise is not finite or not symmetric", measurement.R);
  if (!cholesky_factor(R)) [[unlikely]] {
    throw_invalid("measurement noise is not positive definite", R);
  }
  return R;
}

/// L Q L^T of a positive semidefinite Q. If rounding errors leave this without a Cholesky factor, it is
/// computed as a square.
template <class Scalar, int Dim>
[[nodiscard]] Matrix<Scalar, Dim> transformed_covariance(const Matrix<Scalar, Dim>& L,
                                                         const Matrix<Scalar, Dim>& Q) {
  Matrix<Scalar, Dim> P = congruence<Scalar, Dim, Dim>(L, Q);
  if (cholesky_factor(P)) return P;
  const auto F = root_of_covariance("posterior covariance has a negative eigenvalue", Q);
  return congruence<Scalar, Dim, Dim>(L * F.L, Matrix<Scalar, Dim>::Identity());
}

/// I_KA I_KA^T + K R K^T; where rounding leaves a negative variance, as a sum of squares with the root of R.
template <class Scalar, int Dim, int Measured>
[[nodiscard]] Matrix<Scalar, Dim> joseph_form(const Matrix<Scalar, Dim>& I_KA,
                                              const Matrix<Scalar, Dim, Measured>& K,
                                              const Matrix<Scalar, Measured>& R,
                                              const Matrix<Scalar, Measured>& R_root) {
  Matrix<Scalar, Dim> P = I_KA * I_KA.transpose() + congruence<Scalar, Dim, Measured>(K, R);
  if (cholesky_factor(P)) return P;
  return I_KA * I_KA.transpose() +
         congruence<Scalar, Dim, Measured>(K * R_root, Matrix<Scalar, Measured>::Identity());
}

}  // namespace detail

/// Bayes update of x by a measurement {z, R} (DQV-SLAM Alg. 4 with its line 13 corrected: the
/// cross-covariance is that of x and z).
///
/// Works on a = L^-1 (x - mean), L the root of the prior's covariance: a ~ N(0, I) whether or not that is
/// singular. With z = A a + b + e, Cov(e) = Omega from the regression,
///
///     K = A^T (A A^T + R + Omega)^-1,   a+ = K (z - b),   Q+ = (I - K A)(I - K A)^T + K (R + Omega) K^T,
///
/// which is a sum of squares and thus stays positive definite. Throws unless z is finite and R positive
/// definite.
template <std::floating_point Scalar, int Dim, PoseOrSamples<Scalar> Poses,
          MeasurementModel<Scalar, Dim> Model,
          int Measured = detail::MeasurementOf<Model, Scalar, Dim>::RowsAtCompileTime>
[[nodiscard]] UnscentedUpdateResult<Scalar, Dim, Measured> unscented_update(
    const Gaussian<Scalar, Dim>& prior, const Poses& poses, const Model& h,
    const NoisyMeasurement<Scalar, Measured>& measurement, const UnscentedUpdateOptions& options = {}) {
  using State = Vector<Scalar, Dim>;
  using Square = Matrix<Scalar, Dim>;
  const auto R = detail::checked_noise(measurement);
  if (options.iterations < 1) [[unlikely]] {
    detail::throw_invalid("iterations is not positive", options.iterations);
  }

  const auto& samples = detail::pose_samples(poses);
  const auto standard = UnscentedRule<Dim>{options.kappa}.template standard<Scalar>();
  const Square& L = prior.sqrt_factor();
  UnscentedUpdateResult<Scalar, Dim, Measured> result{.posterior = prior};
  State a = State::Zero();
  Square Q = Square::Identity();
  for (; result.iterations < options.iterations; ++result.iterations) {
    const auto F = detail::cholesky_factor(Q);
    if (!F) break;
    const auto model = detail::regress(h, samples, State(prior.mean() + L * a), Square(L * *F), standard);
    if (!model) break;
    const Square F_inverse = detail::solve_lower<Scalar, Dim, Dim>(*F, Square::Identity());
    const Matrix<Scalar, Measured, Dim> A = model->slope * F_inverse;
    const Matrix<Scalar, Measured> disturbance = R + model->residual;
    const Matrix<Scalar, Measured> S = A * A.transpose() + disturbance;
    const auto C = detail::cholesky_factor(S), D = detail::cholesky_factor(disturbance);
    // If the residual is so large that rounding errors make its sum with R indefinite, Q+ would be no
    // covariance.
    if (!C || !D) break;
    const Matrix<Scalar, Measured> C_inverse =
        detail::solve_lower<Scalar, Measured, Measured>(*C, Matrix<Scalar, Measured>::Identity());
    const Matrix<Scalar, Dim, Measured> whitened_gain = (C_inverse * A).transpose();
    const Matrix<Scalar, Dim, Measured> K = whitened_gain * C_inverse;
    const Vector<Scalar, Measured> innovation = measurement.z - model->mean + A * a;
    const State step = K * innovation;
    const Scalar nis = (C_inverse * innovation).squaredNorm();
    const Square I_KA = Square::Identity() - K * A;
    const Square covariance = detail::joseph_form<Scalar, Dim, Measured>(I_KA, K, disturbance, *D);
    const bool finite = std::isfinite(nis) && (prior.mean() + L * step).allFinite() &&
                        detail::congruence<Scalar, Dim, Dim>(L, covariance).allFinite();
    if (!finite) break;
    if (result.iterations == 0) {
      result.innovation = innovation;
      result.innovation_covariance = S;
      result.cross_covariance = L * A.transpose();
      result.gain = L * K;
      result.nis = nis;
    }
    a = step;
    Q = covariance;
  }
  if (result.iterations > 0) {
    result.posterior = {prior.mean() + L * a, detail::transformed_covariance(L, Q)};
    result.status = UnscentedUpdateStatus::kUpdated;
  }
  return result;
}

}  // namespace antipode
