// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>
#include <limits>
#include <optional>

#include <antipode/detail/cholesky.hpp>
#include <antipode/detail/products.hpp>
#include <antipode/distributions/gaussian_information.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/filters/robust_noise.hpp>

/// @file
/// The normal equations of a weighted least-squares problem, and what follows from them: a step, its
/// covariance, how the solution depends on parameters that are not estimated, and what the measurements say
/// of those.
namespace antipode {

/// Sums over measurements that are linearised at one state x of N dimensions, and at the value 0 of
/// `Considered` parameters c:
///
///     z - h(x + d, c) = e - J d - K c,      z ~ h + noise of the covariance S
///
/// Every measurement gets the weight w of the noise at its squared distance e^T S^-1 e. What the sums are for
/// is in robust_least_squares.hpp. Nothing is on the heap, unless a measurement has a dynamic size.
template <std::floating_point Scalar_, int N, int Considered = 0,
          WeightedNoise<Scalar_> Noise_ = NormalNoise<Scalar_>>
class WeightedSums {
 public:
  using Scalar = Scalar_;                                    ///< of all numbers
  using Noise = Noise_;                                      ///< gives the weights
  using Tangent = Vector<Scalar, N>;                         ///< a change of the state
  using Square = Matrix<Scalar, N>;                          ///< its covariance, or the inverse of it
  using Sensitivity = Matrix<Scalar, N, Considered>;         ///< of the state by the considered parameters
  using Evidence = GaussianInformation<Scalar, Considered>;  ///< on the considered parameters

  /// Without measurements.
  explicit WeightedSums(const Noise& noise = {}) : noise_(noise) {}

  /// Adds a measurement: e, the inverse of S, and the derivatives J of h by the state.
  template <int Dim>
  void add(const Vector<Scalar, Dim>& e, const Matrix<Scalar, Dim>& S_inverse,
           const Matrix<Scalar, Dim, N>& J) {
    static_assert(Considered == 0, "the derivative by the considered parameters is missing");
    const Weights w = weights_of<Dim>(e, S_inverse);
    add_to_state<Dim>(w, e, J, Matrix<Scalar, N, Dim>(J.transpose() * S_inverse));
  }
  /// The same with the derivatives K of h by the considered parameters.
  template <int Dim>
  void add(const Vector<Scalar, Dim>& e, const Matrix<Scalar, Dim>& S_inverse,
           const Matrix<Scalar, Dim, N>& J, const Matrix<Scalar, Dim, Considered>& K) {
    const Weights w = weights_of<Dim>(e, S_inverse);
    const Matrix<Scalar, N, Dim> JtS = J.transpose() * S_inverse;
    add_to_state<Dim>(w, e, J, JtS);
    cross_.noalias() += w.weight * (JtS * K);
    const Matrix<Scalar, Considered, Dim> KtS = w.weight * K.transpose() * S_inverse;
    considered_.information.noalias() += KtS * K;
    considered_.vector.noalias() += KtS * e;
  }
  /// Adds a measurement of `dim` numbers that cannot be predicted from the state, a landmark behind the
  /// camera say: it costs as much as one at a distance of 1000 standard deviations, and has no weight.
  void miss(int dim) {
    constexpr Scalar kDistance = Scalar(1e3);
    cost_ -= noise_.log_density(kDistance * kDistance, dim);
  }
  /// Adds a Gaussian prior of the state's change d and the considered parameters: the inverse of the joint
  /// covariance by its blocks, and the vector information times mean of the first block. The mean of the
  /// considered parameters is 0.
  void add_prior(const Square& information, const Tangent& vector, Scalar squared_distance,
                 const Sensitivity& cross = Sensitivity::Zero()) {
    information_ += information;
    vector_ += vector;
    prior_ += information;
    cross_ += cross;
    cost_ += Scalar(0.5) * squared_distance;
    squared_distance_ += squared_distance;
  }

  /// Minus the sum of the noise's log-densities, and that of the prior.
  [[nodiscard]] Scalar cost() const noexcept { return cost_; }
  /// The sum of the weighted squared distances, and that from the prior.
  [[nodiscard]] Scalar squared_distance() const noexcept { return squared_distance_; }
  /// How many measurements were added.
  [[nodiscard]] int measurements() const noexcept { return measurements_; }
  /// How many numbers they have together.
  [[nodiscard]] int numbers() const noexcept { return numbers_; }
  /// The sum of w J^T S^-1 J, and the information of the prior.
  [[nodiscard]] const Square& information() const noexcept { return information_; }
  /// The sum of w J^T S^-1 e.
  [[nodiscard]] const Tangent& vector() const noexcept { return vector_; }
  /// The cross information of the state and the considered parameters, the sum of w J^T S^-1 K.
  [[nodiscard]] const Sensitivity& cross_information() const noexcept { return cross_; }

  /// The lower Cholesky factor of the information. Nothing if that is singular: the measurements do not
  /// determine the state.
  [[nodiscard]] std::optional<Square> root() const { return root_of(information_); }

  /// The change of the state that minimises the weighted squares, given a root().
  [[nodiscard]] static Tangent solve(const Square& root, const Tangent& vector) {
    return detail::solve_lower_transposed<Scalar, N, 1>(root,
                                                        detail::solve_lower<Scalar, N, 1>(root, vector));
  }
  /// d state / d considered: how the solution depends on parameters that it takes for known.
  [[nodiscard]] Sensitivity sensitivity(const Square& root) const {
    return -detail::solve_lower_transposed<Scalar, N, Considered>(
        root, detail::solve_lower<Scalar, N, Considered>(root, cross_));
  }
  /// What the measurements say of the considered parameters, whatever the state is: the state is eliminated
  /// (Schur complement). The evidence of problems that share these parameters adds up.
  [[nodiscard]] Evidence evidence(const Square& root) const {
    const Matrix<Scalar, N, Considered> half = detail::solve_lower<Scalar, N, Considered>(root, cross_);
    const Tangent whitened = detail::solve_lower<Scalar, N, 1>(root, vector_);
    return {considered_.information - half.transpose() * half,
            considered_.vector - half.transpose() * whitened};
  }

  /// The covariance of the solution under the noise as assumed, but for the considered parameters: the
  /// inverse of the cost's mean curvature. Nothing if that is not positive definite.
  [[nodiscard]] std::optional<Square> covariance_by_noise() const { return inverse_of(prior_ + slopes_); }

  /// The covariance of an M-estimate if all errors have the same distribution, up to their S, which the
  /// residuals show: the variance of their weighted values over their squared mean slope, times the inverse
  /// of the sum of J^T S^-1 J, with the correction for few measurements (Huber, Robust Statistics, 1981,
  /// section 7.6). It follows errors that are larger or smaller than assumed, and outliers. Nothing if no
  /// more numbers were measured than fitted, or if most are outliers.
  [[nodiscard]] std::optional<Square> covariance_by_residuals() const {
    const Scalar count = Scalar(numbers_);
    const Scalar slope = slope_ / count;
    if (!(slope > Scalar(0))) return std::nullopt;
    const auto bread = inverse_of(prior_ + slope * unweighted_);
    const auto spare = bread ? spare_numbers(*bread) : std::nullopt;
    if (!spare) return std::nullopt;
    const Scalar variance = square_slope_ / count - slope * slope;
    const Scalar correction = Scalar(1) + (count - *spare) / count * variance / (slope * slope);
    return between(*bread, prior_ + correction * correction * square_ / *spare * unweighted_);
  }

  /// The same if the errors of measurements with a large influence differ from others: A^-1 B A^-1 (the
  /// sandwich), where A sums the slopes of the weighted residuals and B their squares. Needs hundreds of
  /// measurements; with fewer it is too small.
  [[nodiscard]] std::optional<Square> covariance_by_each_residual() const {
    const auto bread = covariance_by_noise();
    const auto spare = bread ? spare_numbers(*bread) : std::nullopt;
    if (!spare) return std::nullopt;
    return between(*bread, prior_ + Scalar(numbers_) / *spare * squares_);
  }

  /// Whether all sums are finite.
  [[nodiscard]] bool finite() const {
    return std::isfinite(cost_) && std::isfinite(squared_distance_) && information_.allFinite() &&
           vector_.allFinite() && cross_.allFinite();
  }

 private:
  struct Weights {
    Scalar weight;
    Scalar slope;   ///< d (w e) / d e, the mean over all directions
    Scalar square;  ///< w^2 times the mean square of the entries of e, in units of their noise
  };

  template <int Dim>
  [[nodiscard]] Weights weights_of(const Vector<Scalar, Dim>& e, const Matrix<Scalar, Dim>& S_inverse) {
    const int dim = static_cast<int>(e.size());
    const Scalar squared = e.dot(S_inverse * e);
    if (!(squared >= Scalar(0))) cost_ = std::numeric_limits<Scalar>::quiet_NaN();  // S is no covariance
    const Scalar weight = noise_.weight(squared, dim);
    ++measurements_;
    numbers_ += dim;
    cost_ -= noise_.log_density(squared, dim);
    squared_distance_ += weight * squared;
    const Scalar each = squared / Scalar(std::max(dim, 1));
    const Weights w{weight, weight + Scalar(2) * each * noise_.weight_slope(squared, dim),
                    weight * weight * each};
    slope_ += Scalar(dim) * w.slope;
    square_slope_ += Scalar(dim) * w.slope * w.slope;
    square_ += Scalar(dim) * w.square;
    return w;
  }

  template <int Dim>
  void add_to_state(const Weights& w, const Vector<Scalar, Dim>& e, const Matrix<Scalar, Dim, N>& J,
                    const Matrix<Scalar, N, Dim>& JtS) {
    Square information;
    information.noalias() = JtS * J;
    unweighted_ += information;
    information_ += w.weight * information;
    slopes_ += w.slope * information;
    squares_ += w.square * information;
    vector_.noalias() += w.weight * (JtS * e);
  }

  /// The numbers measured less those fitted to them, given the inverse of the curvature: what the prior knew
  /// is not fitted. Nothing if there are none.
  [[nodiscard]] std::optional<Scalar> spare_numbers(const Square& bread) const {
    const Scalar known = bread.cwiseProduct(prior_).sum();  // the trace: both are symmetric
    const Scalar spare = Scalar(numbers_) - (Scalar(N) - std::clamp(known, Scalar(0), Scalar(N)));
    constexpr Scalar kRounding = Scalar(0.5);
    return spare > kRounding ? std::optional(spare) : std::nullopt;
  }

  /// A B A for symmetric matrices.
  [[nodiscard]] static Square between(const Square& A, const Square& B) {
    return detail::congruence<Scalar, N, N>(A, B);
  }
  [[nodiscard]] static std::optional<Square> inverse_of(const Square& A) {
    const auto root = root_of(A);
    if (!root) return std::nullopt;
    const Square half = detail::solve_lower<Scalar, N, N>(*root, Square::Identity());
    return Square(half.transpose() * half);
  }
  [[nodiscard]] static std::optional<Square> root_of(const Square& information) {
    constexpr Scalar kSmallest = Scalar(1e3) * std::numeric_limits<Scalar>::epsilon();  // of a pivot
    auto root = detail::cholesky_factor<Scalar, N>(information);
    if (!root) return root;
    for (int i = 0; i < N; ++i) {
      if (!((*root)(i, i) * (*root)(i, i) > kSmallest * information(i, i))) return std::nullopt;
    }
    return root;
  }

  Noise noise_;
  Square information_ = Square::Zero();
  Square prior_ = Square::Zero();       ///< the prior's part of it
  Square unweighted_ = Square::Zero();  ///< the sum of J^T S^-1 J
  Square slopes_ = Square::Zero();      ///< weighted by the slopes
  Square squares_ = Square::Zero();     ///< weighted by the squares
  Tangent vector_ = Tangent::Zero();
  Sensitivity cross_ = Sensitivity::Zero();
  Evidence considered_;
  Scalar cost_ = Scalar(0), squared_distance_ = Scalar(0);
  Scalar slope_ = Scalar(0), square_slope_ = Scalar(0), square_ = Scalar(0);  ///< sums over all numbers
  int measurements_ = 0, numbers_ = 0;
};

}  // namespace antipode
