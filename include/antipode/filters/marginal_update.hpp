// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <optional>
#include <tuple>
#include <type_traits>
#include <utility>

#include <antipode/detail/cholesky.hpp>
#include <antipode/detail/positive_semidefinite.hpp>
#include <antipode/detail/products.hpp>
#include <antipode/distributions/pose_gaussian.hpp>
#include <antipode/distributions/state_gaussian.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/filters/pose_update_result.hpp>
#include <antipode/filters/update_status.hpp>
#include <antipode/geometry/chart.hpp>
#include <antipode/geometry/extended_pose.hpp>

/// @file
/// Updates of a part of a state: its pose, say, by measurements that do not depend on the rest.
///
/// The part is updated alone, by any update. The rest follows by the linear regression on the part that its
/// covariance contains: exact if the state is Gaussian, however nonlinear the measurement is. A pose of six
/// dimensions takes 57 sigma points, a state of eighteen takes 548.
///
///     const auto pose = pose_marginal(state);                     // PoseGaussian
///     const auto update = quadratic_update(pose, log_likelihood);
///     if (update.status == UpdateStatus::kConverged) {
///       const auto all = with_marginal(state, update.posterior);  // StateGaussian
///     }
///
/// PoseMarginalUpdate does this in a PoseFilter.
namespace antipode {

namespace detail {

/// The pose in the first part of a state, and the chart of its marginal density.
template <class C>
struct PosePart;
template <class Scalar>
struct PosePart<ScrewChart<Scalar>> {
  using Marginal = ScrewChart<Scalar>;
  static constexpr int kRotation = 0, kTranslation = 3;
  [[nodiscard]] static const DualQuaternion<Scalar>& pose(const DualQuaternion<Scalar>& x) { return x; }
};
template <class Scalar>
struct PosePart<SplitChart<Scalar>> : PosePart<ScrewChart<Scalar>> {
  using Marginal = SplitChart<Scalar>;
};
template <class Scalar, int K>
struct PosePart<ExtendedPoseChart<Scalar, K>> {
  using Marginal = ScrewChart<Scalar>;
  static constexpr int kRotation = 0, kTranslation = 3 + 3 * ExtendedPose<Scalar, K>::kPosition;
  [[nodiscard]] static const DualQuaternion<Scalar>& pose(const ExtendedPose<Scalar, K>& x) { return x.pose; }
};

/// The marginal of a state in the chart C that has its pose and the parts `Parts` of its tuple.
template <class C, std::size_t... Parts>
struct PoseMarginal;
template <class First, class... Others, std::size_t... Parts>
struct PoseMarginal<ProductChart<First, Others...>, Parts...> {
  static_assert(((Parts > 0) && ...), "the pose of the first part is in the marginal anyway");
  using State = ProductChart<First, Others...>;
  using Scalar = typename State::Scalar;
  using Pose = PosePart<First>;
  template <std::size_t Part>
  using ChartOf = std::tuple_element_t<Part, std::tuple<First, Others...>>;
  using Chart = typename std::conditional_t<
      sizeof...(Parts) == 0, std::type_identity<typename Pose::Marginal>,
      std::type_identity<ProductChart<typename Pose::Marginal, ChartOf<Parts>...>>>::type;
  static constexpr int N = State::kDim, M = Chart::kDim;
  using Density =
      typename std::conditional_t<sizeof...(Parts) == 0,
                                  std::type_identity<PoseGaussian<Scalar, typename Pose::Marginal>>,
                                  std::type_identity<StateGaussian<Chart>>>::type;

  /// The coordinates of the state that are those of the marginal, in its order.
  static constexpr std::array<int, static_cast<std::size_t>(M)> kCoordinates = [] {
    std::array<int, static_cast<std::size_t>(M)> coordinates{};
    std::size_t next = 0;
    const auto append = [&](int first, int count) {
      for (int i = 0; i < count; ++i) coordinates[next++] = first + i;
    };
    append(Pose::kRotation, 3);
    append(Pose::kTranslation, 3);
    (append(State::template kBegin<Parts>, ChartOf<Parts>::kDim), ...);
    return coordinates;
  }();
  [[nodiscard]] static int at(int i) { return kCoordinates[static_cast<std::size_t>(i)]; }

  [[nodiscard]] static typename Chart::Point mean(const typename State::Point& state) {
    if constexpr (sizeof...(Parts) == 0) {
      return Pose::pose(std::get<0>(state));
    } else {
      return {Pose::pose(std::get<0>(state)), std::get<Parts>(state)...};
    }
  }
  /// Rows of the covariance, M x N: that of the marginal with the state.
  [[nodiscard]] static Matrix<Scalar, M, N> rows(const Matrix<Scalar, N>& P) {
    Matrix<Scalar, M, N> C;
    for (int i = 0; i < M; ++i) C.row(i) = P.row(at(i));
    return C;
  }
  /// Its columns in the marginal.
  [[nodiscard]] static Matrix<Scalar, M> square(const Matrix<Scalar, M, N>& C) {
    Matrix<Scalar, M> P;
    for (int i = 0; i < M; ++i) P.col(i) = C.col(at(i));
    return P;
  }
};

/// The Cholesky factor of a covariance; nothing if a coordinate is known from those before it up to rounding
/// errors.
template <class Scalar, int M>
[[nodiscard]] std::optional<Matrix<Scalar, M>> factor_of_regular(const Matrix<Scalar, M>& P) {
  auto L = cholesky_factor<Scalar, M>(P);
  if (!L) return std::nullopt;
  for (int i = 0; i < M; ++i) {
    if (!((*L)(i, i) * (*L)(i, i) > kSymmetryTolerance<Scalar> * P(i, i))) return std::nullopt;
  }
  return L;
}

}  // namespace detail

/// How with_marginal() ended.
enum class MarginalStatus {
  kUpdated,   ///< the posterior has the given marginal
  kSingular,  ///< the covariance of the prior's marginal is singular: what is known exactly cannot have
              ///< moved. The posterior is the prior
  kNotFinite  ///< the result is too large to compute with. The posterior is the prior
};

/// The result of with_marginal().
template <ConcentratedDensity Density>
struct MarginalUpdate {
  Density posterior;                                 ///< the status says whether to use it
  MarginalStatus status = MarginalStatus::kUpdated;  ///< how it ended
};

/// The marginal density of the pose in the first part of a joint state, ProductChart<First, ...> with First
/// the ScrewChart, the SplitChart or an ExtendedPoseChart: a PoseGaussian. With numbers of further parts,
/// pose_marginal<2>(state) for a time offset say, a StateGaussian of the pose and these.
template <std::size_t... Parts, Chart C>
[[nodiscard]] typename detail::PoseMarginal<C, Parts...>::Density pose_marginal(
    const StateGaussian<C>& state) {
  using Marginal = detail::PoseMarginal<C, Parts...>;
  return {Marginal::mean(state.state), Marginal::square(Marginal::rows(state.covariance))};
}

/// The state with another density of its marginal pose_marginal<Parts...>(state): the posterior of that, by
/// measurements that do not depend on the rest of the state.
///
/// With C the covariance of the state with the marginal, P and P+ the covariances of the marginal before and
/// after, and d its step, in the chart of the prior's mean: the state moves by C P^-1 d, and its covariance
/// is reduced by C P^-1 (P - P+) P^-1 C^T. Exact if the state is Gaussian in its chart. Throws unless the
/// covariances are finite and symmetric.
template <std::size_t... Parts, Chart C>
[[nodiscard]] MarginalUpdate<StateGaussian<C>> with_marginal(
    const StateGaussian<C>& state, const typename detail::PoseMarginal<C, Parts...>::Density& posterior) {
  using Marginal = detail::PoseMarginal<C, Parts...>;
  using Scalar = typename C::Scalar;
  constexpr int N = Marginal::N, M = Marginal::M;
  detail::require_symmetric(state);
  detail::require_symmetric(posterior);
  const auto& [mean, covariance] = posterior;
  const Matrix<Scalar, M, N> rows = Marginal::rows(state.covariance);
  const auto L = detail::factor_of_regular<Scalar, M>(Marginal::square(rows));
  if (!L) return {state, MarginalStatus::kSingular};
  const Matrix<Scalar, M, N> whitened = detail::solve_lower<Scalar, M, N>(*L, rows);
  Matrix<Scalar, N, M> gain = detail::solve_lower_transposed<Scalar, M, N>(*L, whitened).transpose();
  // What the marginal leaves open: nothing of itself.
  Matrix<Scalar, N> open = state.covariance - whitened.transpose() * whitened;
  for (int i = 0; i < M; ++i) {
    open.row(Marginal::at(i)).setZero();
    open.col(Marginal::at(i)).setZero();
    gain.row(Marginal::at(i)) = Vector<Scalar, M>::Unit(i).transpose();
  }
  const Vector<Scalar, M> d = Marginal::Chart::local(Marginal::mean(state.state), mean);
  const Matrix<Scalar, M> back = Marginal::Chart::jacobian_inverse(d);
  const Matrix<Scalar, M> P = detail::congruence<Scalar, M, M>(back, covariance);
  const Vector<Scalar, N> xi = gain * d;
  if (!detail::is_finite(xi.squaredNorm())) return {state, MarginalStatus::kNotFinite};
  const Matrix<Scalar, N> about_prior = open + detail::congruence<Scalar, N, M>(gain, P);
  StateGaussian<C> result{C::normalized(C::retract(state.state, xi)),
                          detail::congruence<Scalar, N, N>(C::jacobian(xi), about_prior)};
  if (!detail::all_finite(result.covariance)) return {state, MarginalStatus::kNotFinite};
  return {result, MarginalStatus::kUpdated};
}

/// The update of a PoseFilter<StateGaussian<C>, Rule, PoseMarginalUpdate<Update, Parts...>> that applies
/// `Update` to pose_marginal<Parts...>. The rule is one of the marginal's dimension: MysovskikhRule<6> for
/// the pose alone, Degree5Rule<7> for the pose and a time offset. Measurement models take a pose, or the
/// tuple of the pose and the parts.
///
/// A state whose marginal is singular is not updated; the status is kDiverged. Predict first: noise of the
/// motion makes the marginal regular.
template <class Update, std::size_t... Parts>
struct PoseMarginalUpdate {
  Update update = {};  ///< of the marginal

  /// The posterior of the joint state.
  template <Chart C, class Measurement, class Rule>
  requires std::invocable<const Update&, const typename detail::PoseMarginal<C, Parts...>::Density&,
                          Measurement, const Rule&> [[nodiscard]] UpdateResult<StateGaussian<C>>
  operator()(const StateGaussian<C>& prior, Measurement&& measurement, const Rule& rule) const {
    const auto of_part = update(pose_marginal<Parts...>(prior), std::forward<Measurement>(measurement), rule);
    const auto all = with_marginal<Parts...>(prior, of_part.posterior);
    auto result = detail::as_result_of(all.posterior, of_part, of_part.limit_hit);
    if (all.status != MarginalStatus::kUpdated) result.status = UpdateStatus::kDiverged;
    return result;
  }
};

}  // namespace antipode
