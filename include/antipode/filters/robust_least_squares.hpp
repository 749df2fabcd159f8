// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <concepts>
#include <limits>
#include <optional>
#include <type_traits>
#include <utility>

#include <antipode/detail/check.hpp>
#include <antipode/detail/products.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/filters/robust_noise.hpp>
#include <antipode/filters/weighted_sums.hpp>
#include <antipode/geometry/chart.hpp>

/// @file
/// A state on a manifold from any number of measurements with outliers, by Gauss-Newton steps with weights
/// (iteratively reweighted least squares), with the covariance that the residuals show.
///
/// Parameters that the measurements depend on, but that are not to be estimated with this state, are
/// *considered*: a calibration, when a motion is estimated. The result says how the state depends on them,
/// which makes its covariance and its correlation with them known, and what the measurements say of them,
/// which adds up over many states (the Schur complement of a problem with many motions and one calibration).
namespace antipode {

/// How robust_least_squares() ended.
enum class LeastSquaresStatus {
  kConverged,     ///< the steps settled at a minimum
  kNotSettled,    ///< they did not, or the state left its chart: do not trust the covariance
  kAmbiguous,     ///< the steps settled, but elsewhere is a minimum with about the same cost
  kUndetermined,  ///< the measurements and the prior leave a direction of the state open; the state is the
                  ///< last one, the covariance not finite
  kNotFinite,     ///< a measurement is not finite; the same
};

/// What the covariance of the result is computed from.
enum class CovarianceFrom {
  kResiduals,     ///< the residuals, which share a distribution: for twenty measurements or more
  kEachResidual,  ///< every residual as it is: for hundreds of measurements of different kinds
  kNoise,         ///< the noise as assumed: for a few measurements
};

/// When the steps end, and what is checked.
template <std::floating_point Scalar>
struct LeastSquaresOptions {
  /// Most evaluations of the model.
  int max_iterations = 100;
  /// A step by less, in standard deviations of the state, is the last.
  Scalar tolerance = Scalar(1e-3);
  /// A step that increases the cost by more is shortened. More than rounding, for models that compute the
  /// noise anew at each state.
  Scalar max_increase = Scalar(1e-3);
  CovarianceFrom covariance = CovarianceFrom::kResiduals;  ///< of the result
  /// Whether to look for a second minimum, beyond that which the cost has if errors are four times as large.
  bool check_modes = true;
};

/// A Gaussian prior of a state, and how it is correlated with the considered parameters, whose mean is 0.
template <Chart C, int Considered = 0>
struct LeastSquaresPrior {
  using Scalar = typename C::Scalar;               ///< of all numbers
  static constexpr int kDim = C::kDim;             ///< of the state
  using Square = Matrix<Scalar, kDim>;             ///< in the chart about the mean
  using Cross = Matrix<Scalar, kDim, Considered>;  ///< state by considered parameters

  typename C::Point mean;                   ///< the most likely state
  Square information = Square::Zero();      ///< the state's block of the inverse of the joint covariance
  Cross cross_information = Cross::Zero();  ///< the block of both

  /// Independent of the considered parameters. Throws unless the covariance is positive definite.
  [[nodiscard]] static LeastSquaresPrior from_covariance(const typename C::Point& mean,
                                                         const Square& covariance) {
    LeastSquaresPrior prior{mean};
    prior.information = GaussianInformation<Scalar, kDim>::from_covariance({}, covariance).information;
    if (!prior.information.allFinite()) [[unlikely]]
      detail::throw_invalid("covariance of the prior is not positive definite; its trace is",
                            covariance.trace());
    return prior;
  }
  /// From the blocks of the joint covariance. Throws unless that is positive definite.
  [[nodiscard]] static LeastSquaresPrior from_covariance(const typename C::Point& mean,
                                                         const Square& covariance, const Cross& cross,
                                                         const Matrix<Scalar, Considered>& considered) {
    Matrix<Scalar, kDim + Considered> joint;
    joint << covariance, cross, cross.transpose(), considered;
    const auto all = LeastSquaresPrior<VectorChart<Scalar, kDim + Considered>>::from_covariance({}, joint);
    return {mean, all.information.template topLeftCorner<kDim, kDim>(),
            all.information.template topRightCorner<kDim, Considered>()};
  }
};

/// A state, what is known of it, and what it leaves to know of the considered parameters.
template <Chart C, int Considered = 0>
struct LeastSquaresResult {
  using Scalar = typename C::Scalar;                         ///< of all numbers
  static constexpr int kDim = C::kDim;                       ///< of the state
  using Square = Matrix<Scalar, kDim>;                       ///< in the chart about the state
  using Sensitivity = Matrix<Scalar, kDim, Considered>;      ///< state by considered parameters
  using Evidence = GaussianInformation<Scalar, Considered>;  ///< on the considered parameters

  typename C::Point state;  ///< the estimate
  /// If the considered parameters were known to be 0.
  Square covariance = Square::Constant(std::numeric_limits<Scalar>::quiet_NaN());
  /// The weighted information of the measurements and the prior at the state: what fixes it, by its blocks.
  Square information = Square::Zero();
  Sensitivity sensitivity = Sensitivity::Zero();  ///< d state / d considered
  Evidence considered = {};  ///< what the measurements say of the considered parameters, without the prior
  LeastSquaresStatus status = LeastSquaresStatus::kNotFinite;  ///< only kConverged is to be trusted
  Scalar cost = Scalar(0);              ///< minus the log-densities of noise and prior, without constants
  Scalar squared_distance = Scalar(0);  ///< sum of the weighted squared distances, and that from the prior
  /// log of the probability of the measurements in Laplace's approximation, without constants; comparable
  /// between models of the same measurements under the same prior.
  Scalar log_evidence = Scalar(0);
  int measurements = 0;  ///< that could be predicted from the state
  int numbers = 0;       ///< in them
  int evaluations = 0;   ///< of the model

  /// Whether the state is one to go on with.
  [[nodiscard]] bool converged() const noexcept { return status == LeastSquaresStatus::kConverged; }
  /// The covariance of the state if the considered parameters have this covariance.
  [[nodiscard]] Square covariance_with(const Matrix<Scalar, Considered>& of_considered) const {
    return covariance + detail::congruence<Scalar, kDim, Considered>(sensitivity, of_considered);
  }
  /// Its covariance with them.
  [[nodiscard]] Sensitivity cross_covariance(const Matrix<Scalar, Considered>& of_considered) const {
    return sensitivity * of_considered;
  }
};

namespace detail {

/// Noise whose standard deviations are as many times as large.
template <class Scalar, class Noise>
struct WidenedNoise {
  Noise noise;
  Scalar factor2 = Scalar(1);  ///< the square of the factor

  void check() const { noise.check(); }
  [[nodiscard]] Scalar log_density(Scalar squared_distance, int dim) const {
    return noise.log_density(squared_distance / factor2, dim);
  }
  [[nodiscard]] Scalar weight(Scalar squared_distance, int dim) const {
    return noise.weight(squared_distance / factor2, dim) / factor2;
  }
  [[nodiscard]] Scalar weight_slope(Scalar squared_distance, int dim) const {
    return noise.weight_slope(squared_distance / factor2, dim) / (factor2 * factor2);
  }
};

/// The iteration of robust_least_squares().
template <class C, int Considered, class Model, class Noise>
class RobustIteration {
 public:
  using Scalar = typename C::Scalar;
  static constexpr int N = C::kDim;
  using Point = typename C::Point;
  using Sums = WeightedSums<Scalar, N, Considered, Noise>;
  using Square = Matrix<Scalar, N>;
  using Prior = LeastSquaresPrior<C, Considered>;
  using Result = LeastSquaresResult<C, Considered>;
  using Options = LeastSquaresOptions<Scalar>;

  RobustIteration(const Model& model, const Noise& noise, const Prior* prior, const Options& options)
      : model_(model), noise_(noise), prior_(prior), options_(options) {}

  [[nodiscard]] Result run(const Point& initial) {
    Point state = initial;
    Sums sums = evaluate(state);
    LeastSquaresStatus status = LeastSquaresStatus::kNotSettled;
    std::optional<Square> root;
    while (true) {
      if (!sums.finite()) return ended(LeastSquaresStatus::kNotFinite, state, sums);
      root = sums.root();
      if (!root) return ended(LeastSquaresStatus::kUndetermined, state, sums);
      const auto step = Sums::solve(*root, sums.vector());
      const Scalar length = std::sqrt(std::abs(step.dot(sums.vector())));  // in standard deviations
      if (!std::isfinite(length)) return ended(LeastSquaresStatus::kNotFinite, state, sums);
      if (length <= options_.tolerance) {
        if (C::contains(step)) state = C::normalized(C::retract(state, step));
        status = LeastSquaresStatus::kConverged;
        break;
      }
      if (!advance(step, state, sums)) break;
    }
    return completed(status, state, sums, *root);
  }

 private:
  [[nodiscard]] Sums evaluate(const Point& state) {
    Sums sums(noise_);
    model_(state, sums);
    ++evaluations_;
    if (prior_ == nullptr) return sums;
    const Vector<Scalar, N> from_mean = C::local(prior_->mean, state);
    const Square J = C::jacobian_inverse(from_mean);
    const Square information = congruence<Scalar, N, N>(J.transpose(), prior_->information);
    const Vector<Scalar, N> pull = prior_->information * from_mean;
    const Vector<Scalar, N> vector = -(J.transpose() * pull);
    const Scalar squared_distance = from_mean.dot(pull);
    if constexpr (Considered > 0) {
      sums.add_prior(information, vector, squared_distance, J.transpose() * prior_->cross_information);
    } else {
      sums.add_prior(information, vector, squared_distance);
    }
    return sums;
  }

  /// Moves the state by the step, or by a part of it that does not increase the cost. Returns false if there
  /// is none, or if there were too many evaluations.
  [[nodiscard]] bool advance(const Vector<Scalar, N>& step, Point& state, Sums& sums) {
    constexpr Scalar kShortest = Scalar(0.01);
    for (Scalar share(1); share > kShortest && evaluations_ < options_.max_iterations; share /= Scalar(2)) {
      const Vector<Scalar, N> part = share * step;
      if (!C::contains(part)) continue;
      const Point next = C::normalized(C::retract(state, part));
      const Sums at_next = evaluate(next);
      if (!(at_next.cost() <= sums.cost() + options_.max_increase)) continue;
      state = next;
      sums = at_next;
      return true;
    }
    return false;
  }

  [[nodiscard]] Result ended(LeastSquaresStatus status, const Point& state, const Sums& sums) const {
    Result result{.state = state};
    result.status = status;
    result.cost = sums.cost();
    result.squared_distance = sums.squared_distance();
    result.measurements = sums.measurements();
    result.numbers = sums.numbers();
    result.evaluations = evaluations_;
    return result;
  }

  [[nodiscard]] Result completed(LeastSquaresStatus status, const Point& state, const Sums& sums,
                                 const Square& root) const {
    Result result = ended(status, state, sums);
    result.information = sums.information();
    result.log_evidence = -sums.cost();
    for (int i = 0; i < N; ++i) result.log_evidence -= std::log(root(i, i));
    if constexpr (Considered > 0) {
      result.sensitivity = sums.sensitivity(root);
      result.considered = sums.evidence(root);
      if (prior_ != nullptr && !prior_->cross_information.isZero(Scalar(0)))
        remove_prior(result.considered, state);
    }
    const auto covariance = covariance_of(sums);
    if (covariance && covariance->allFinite() && cholesky_factor<Scalar, N>(*covariance)) {
      result.covariance = *covariance;
    } else {
      result.status = LeastSquaresStatus::kUndetermined;
    }
    return result;
  }

  [[nodiscard]] std::optional<Square> covariance_of(const Sums& sums) const {
    if (options_.covariance == CovarianceFrom::kNoise) return sums.covariance_by_noise();
    return options_.covariance == CovarianceFrom::kResiduals ? sums.covariance_by_residuals()
                                                             : sums.covariance_by_each_residual();
  }

  /// The prior's own information on the considered parameters, which its cross information hides in the sums.
  void remove_prior(typename Result::Evidence& evidence, const Point& state) const {
    const auto root = cholesky_factor<Scalar, N>(prior_->information);
    if (!root) return;
    const auto half = solve_lower<Scalar, N, Considered>(*root, prior_->cross_information);
    evidence.information += half.transpose() * half;
    evidence.vector -= prior_->cross_information.transpose() * C::local(prior_->mean, state);
  }

  const Model& model_;
  const Noise& noise_;
  const Prior* prior_;
  const Options& options_;
  int evaluations_ = 0;
};

template <class Scalar>
void check_options(const LeastSquaresOptions<Scalar>& options) {
  if (options.max_iterations < 1) [[unlikely]]
    throw_invalid("max_iterations is not positive", options.max_iterations);
  if (!(options.tolerance > Scalar(0))) [[unlikely]]
    throw_invalid("tolerance is not positive", options.tolerance);
  if (!(options.max_increase >= Scalar(0))) [[unlikely]]
    throw_invalid("max_increase is negative", options.max_increase);
}

}  // namespace detail

/// The state that explains the measurements best, under noise of the given kind (NormalNoise, CauchyLoss,
/// StudentT, Contamination), from `initial` on, which has to be near enough for Gauss-Newton.
///
/// model(state, sums) calls sums.add() for every measurement, with its innovation, noise and derivatives at
/// that state; see WeightedSums. It may compute anything anew at each state, the noise too. The derivatives
/// are those by a vector of the chart about the state, J a = d h(C::retract(state, a)).
///
/// A starting point, outliers in the majority or a wide prior can lead to a wrong minimum. Only one other is
/// looked for (check_modes), so for a first guess among many outliers use RANSAC.
///
/// The mean NEES of a pose by points of which 0, 5 or 20 % are outliers (6 is right; the three kinds of noise
/// with tails differ little):
///
///     points               15             60            300
///     kResiduals      6.4 to 8.5     5.8 to 6.1     6.1 to 6.3
///     kEachResidual   9.7 to 12.5    6.6 to 7.0     6.3 to 6.5
///     kNoise          5.9 to 6.5     5.6 to 5.9     5.8 to 6.0    with StudentT and Contamination
///     kNoise               4.1            3.7            3.8      with CauchyLoss, which is no density
///
/// kNoise is right only if the noise is as assumed. Throws on invalid options or noise, and unless `initial`
/// and the mean of the prior are finite.
template <Chart C, int Considered = 0, class Model, WeightedNoise<typename C::Scalar> Noise>
[[nodiscard]] LeastSquaresResult<C, Considered> robust_least_squares(
    const typename C::Point& initial, const Model& model, const Noise& noise,
    const LeastSquaresOptions<typename C::Scalar>& options = {},
    const LeastSquaresPrior<C, Considered>* prior = nullptr) {
  using Scalar = typename C::Scalar;
  constexpr Scalar kWidening2 = Scalar(16);  // errors four times as large
  constexpr Scalar kLogRatio = Scalar(3);    // of the likelihoods of two minima that count as equal
  constexpr Scalar kApart2 = Scalar(9);      // three standard deviations
  C::require_finite(initial);
  if (prior) C::require_finite(prior->mean);
  detail::check_options(options);
  noise.check();
  const auto run = [&](const typename C::Point& from, const auto& with) {
    using With = std::remove_cvref_t<decltype(with)>;
    return detail::RobustIteration<C, Considered, Model, With>(model, with, prior, options).run(from);
  };
  auto result = run(initial, noise);
  if (!options.check_modes || !result.converged()) return result;
  const auto rough = run(initial, detail::WidenedNoise<Scalar, Noise>{noise, kWidening2});
  if (!rough.converged()) return result;
  const Vector<Scalar, C::kDim> beyond = -C::local(rough.state, result.state);
  if (!C::contains(beyond)) return result;
  auto other = run(C::retract(rough.state, beyond), noise);
  const int evaluations = result.evaluations + rough.evaluations + other.evaluations;
  result.evaluations = other.evaluations = evaluations;
  if (!other.converged()) return result;
  const Vector<Scalar, C::kDim> apart = C::local(result.state, other.state);
  const auto root = detail::cholesky_factor<Scalar, C::kDim>(result.covariance);
  if (root && detail::solve_lower<Scalar, C::kDim, 1>(*root, apart).squaredNorm() <= kApart2) return result;
  const Scalar worse = other.cost - result.cost;
  if (worse < Scalar(0)) std::swap(result, other);
  if (std::abs(worse) < kLogRatio) result.status = LeastSquaresStatus::kAmbiguous;
  return result;
}

}  // namespace antipode
