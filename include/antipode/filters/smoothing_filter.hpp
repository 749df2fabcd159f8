// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <limits>
#include <type_traits>
#include <utility>
#include <vector>

#include <antipode/detail/positive_semidefinite.hpp>
#include <antipode/detail/products.hpp>
#include <antipode/distributions/pose_gaussian.hpp>
#include <antipode/distributions/state_gaussian.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/filters/predict.hpp>
#include <antipode/geometry/dual_quaternion.hpp>
#include <antipode/geometry/jacobians.hpp>

/// @file
/// Smoothing: what all measurements, the later ones too, tell about every state of a filter (Rauch, Tung,
/// Striebel, on a manifold).
///
/// Between two times, the filter knows the state x by its mean m and covariance P, and predicts x' = f(x)
/// with noise by its mean m' and covariance P' = F P F^T + Q. In the charts about m and m', with xi =
/// local(m, x) and xi' = local(m', x'), to first order xi' = F xi + noise. So xi and xi' are jointly Gaussian
/// with the cross-covariance P F^T, and
///
///     xi | xi' ~ N(G xi', P - G P' G^T),   G = P F^T P'^-1.
///
/// Measurements after the prediction tell about x through x' only. If all of them give x' the mean m'' and
/// the covariance P'', then with d = local(m', m'') the vector xi' has the mean d and the covariance S = J
/// P'' J^T, J = jacobian_inverse(d), and the vector xi has
///
///     mean G d,   covariance P + G (S - P') G^T = (I - G F) P (I - G F)^T + G (S + Q) G^T.
///
/// The last form is a sum of squares and stays positive semidefinite. The mean moves to retract(m, G d), and
/// the covariance with it. From the last state backwards this is one pass, exact where f and the measurements
/// are linear in the charts. Where P' is singular, its pseudo-inverse is: what cannot vary does not.
/// References: H. Rauch, F. Tung, C. Striebel, "Maximum likelihood estimates of linear dynamic systems",
/// 1965; S. Sarkka, "Bayesian Filtering and Smoothing", sec. 8.2.
namespace antipode {

/// A prediction of a filter, as far as smoothing needs it.
template <ConcentratedDensity Density>
struct RecordedPrediction {
  using Square = Matrix<typename Density::Scalar, Density::Chart::kDim>;  ///< covariances and Jacobians

  Density before;     ///< what was known before the prediction
  Density predicted;  ///< what the filter predicted from it
  Square F;           ///< the Jacobian of the prediction in the charts about both means
  Square Q;           ///< the covariance of its noise
};

namespace detail {

/// P F^T P'^-1, with the pseudo-inverse of P'. Eigenvalues of P' that rounding errors explain, whatever the
/// units, count as zero.
template <class Density>
[[nodiscard]] auto smoothing_gain(const RecordedPrediction<Density>& step) {
  using Scalar = typename Density::Scalar;
  constexpr int N = Density::Chart::kDim;
  const auto& [before_mean, P] = step.before;
  const auto& [predicted_mean, P_predicted] = step.predicted;
  const ScaledEigen<Scalar, N> scaled(P_predicted);
  const Scalar smallest = Scalar(4 * N) * std::numeric_limits<Scalar>::epsilon() *
                          std::max(scaled.eigen.values[N - 1], Scalar(0));
  Vector<Scalar, N> reciprocals;
  for (int i = 0; i < N; ++i) {
    reciprocals[i] = scaled.eigen.values[i] > smallest ? Scalar(1) / scaled.eigen.values[i] : Scalar(0);
  }
  const Matrix<Scalar, N> inverse = scaled_square<Scalar, N, N>(scaled.eigen.vectors, reciprocals);
  Matrix<Scalar, N> G = P * step.F.transpose();
  for (int j = 0; j < N; ++j) G.col(j) /= scaled.deviations[j];
  G = (G * inverse).eval();
  for (int j = 0; j < N; ++j) G.col(j) /= scaled.deviations[j];
  return G;
}

/// x <- x w in the screw chart: log((x w)^-1 (x exp(xi) w)) = Ad(w^-1) xi.
template <class Scalar>
[[nodiscard]] Matrix6<Scalar> jacobian_of_motion(const PoseGaussian<Scalar>&,
                                                 const DualQuaternion<Scalar>& w) {
  return w.inverse().adjoint();
}
/// x <- x w in the split chart: see predict_closed_form().
template <class Scalar>
[[nodiscard]] Matrix6<Scalar> jacobian_of_motion(const SplitPoseGaussian<Scalar>& state,
                                                 const DualQuaternion<Scalar>& w) {
  Matrix6<Scalar> F = Matrix6<Scalar>::Identity();
  F.template topLeftCorner<3, 3>() = w.rotation_matrix().transpose();
  F.template bottomLeftCorner<3, 3>() = -state.pose.rotation_matrix() * skew(w.translation());
  return F;
}

}  // namespace detail

/// What is known of the state before a prediction, given `after`: all that is known of the state after it.
/// See the equations above. Throws unless the covariances of `step` and `after` are finite and symmetric.
template <ConcentratedDensity Density>
[[nodiscard]] Density smooth(const RecordedPrediction<Density>& step,
                             const std::type_identity_t<Density>& after) {
  using Scalar = typename Density::Scalar;
  using Chart = typename Density::Chart;
  constexpr int N = Chart::kDim;
  const auto& [mean, P] = step.before;
  const auto& [predicted_mean, P_predicted] = step.predicted;
  const auto& [after_mean, P_after] = after;
  detail::require_symmetric(step.before);
  detail::require_symmetric(step.predicted);
  detail::require_symmetric(after);
  detail::require_covariance<Scalar, N>(detail::kAsymmetricNoise, step.Q);
  const Matrix<Scalar, N> G = detail::smoothing_gain(step);
  const Vector<Scalar, N> d = Chart::local(predicted_mean, after_mean);
  const Vector<Scalar, N> shift = G * d;
  const Matrix<Scalar, N> rest = Matrix<Scalar, N>::Identity() - G * step.F;
  const Matrix<Scalar, N> S = detail::congruence<Scalar, N, N>(Chart::jacobian_inverse(d), P_after);
  const Matrix<Scalar, N> about_mean = detail::congruence<Scalar, N, N>(rest, P) +
                                       detail::congruence<Scalar, N, N>(G, Matrix<Scalar, N>(S + step.Q));
  return {Chart::normalized(Chart::retract(mean, shift)),
          detail::congruence<Scalar, N, N>(Chart::jacobian(shift), about_mean)};
}

/// A PoseFilter or StateFilter that remembers its predictions, and smooths them when all measurements are in.
///
/// Filters with a PoseGaussian or a StateGaussian only. The memory grows with every prediction, by two
/// densities and two matrices.
template <class Filter>
requires std::same_as<typename Filter::Density, typename Filter::Belief>
class SmoothingFilter {
 public:
  using Belief = typename Filter::Belief;  ///< a PoseGaussian or a StateGaussian
  using Scalar = typename Filter::Scalar;  ///< of states and covariances
  using State = typename Filter::State;    ///< a pose, or a tuple of the parts of the state
  using Square = typename Filter::Square;  ///< covariances and Jacobians

  /// Continues the filter, from what it knows now.
  explicit SmoothingFilter(Filter filter) : filter_(std::move(filter)) {}

  /// What the filter knows, from the measurements so far.
  [[nodiscard]] Belief belief() const { return filter_.belief(); }

  /// PoseFilter::predict with a measured motion and its noise.
  void predict(const DualQuaternion<Scalar>& T_before_now,
               const PoseGaussian<Scalar>& noise) requires std::same_as<State, DualQuaternion<Scalar>> {
    const Belief before = filter_.belief();
    filter_.predict(T_before_now, noise);
    const Square F = detail::jacobian_of_motion(before, T_before_now * noise.pose);
    const Square Q = predict_closed_form(Belief{before.pose, Square::Zero()}, T_before_now, noise).covariance;
    predictions_.push_back({before, filter_.belief(), F, Q});
  }
  /// PoseFilter::predict with a function, its Jacobian and the covariance of the noise.
  template <std::invocable<const State&> F>
  void predict(F&& f, const std::type_identity_t<Square>& jacobian,
               const std::type_identity_t<Square>& noise) {
    const Belief before = filter_.belief();
    filter_.predict(std::forward<F>(f), jacobian, noise);
    predictions_.push_back({before, filter_.belief(), jacobian, noise});
  }

  /// PoseFilter::update. Any number of them may follow a prediction.
  template <class Measurement>
  auto update(Measurement&& measurement) {
    return filter_.update(std::forward<Measurement>(measurement));
  }
  /// PoseFilter::propose.
  template <class Measurement>
  [[nodiscard]] auto propose(Measurement&& measurement) const {
    return filter_.propose(std::forward<Measurement>(measurement));
  }
  /// PoseFilter::commit.
  bool commit(const typename Filter::Proposal& proposal) { return filter_.commit(proposal); }

  /// What all measurements so far tell about the states: before the first prediction, and after every one.
  /// The last is belief().
  [[nodiscard]] std::vector<Belief> smoothed() const {
    std::vector<Belief> beliefs{filter_.belief()};
    beliefs.reserve(predictions_.size() + 1);
    for (auto step = predictions_.rbegin(); step != predictions_.rend(); ++step) {
      beliefs.push_back(smooth(*step, beliefs.back()));
    }
    std::reverse(beliefs.begin(), beliefs.end());
    return beliefs;
  }

 private:
  Filter filter_;
  std::vector<RecordedPrediction<Belief>> predictions_;
};

}  // namespace antipode
