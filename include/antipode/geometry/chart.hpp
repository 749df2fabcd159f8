// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>
#include <cstddef>
#include <numbers>
#include <tuple>
#include <utility>

#include <antipode/detail/check.hpp>
#include <antipode/eigen_types.hpp>
#include <antipode/geometry/dual_quaternion.hpp>
#include <antipode/geometry/jacobians.hpp>
#include <antipode/geometry/quaternion.hpp>

/// @file
/// Charts: vectors that describe the points of a manifold relative to one of them. A Gaussian density on a
/// manifold is a Gaussian of these vectors about the mean. The chart decides which densities can be
/// represented well, and which measurements are linear.
///
///     ScrewChart      pose   x exp(phi, rho)         follows a moving body: odometry, landmarks in its frame
///     SplitChart      pose   R exp(phi), t + d       rotation and position apart: altimeter, GPS, beacons
///     VectorChart     R^N    v + d
///     ProductChart    tuple  each part by its own    joint states: a pose with velocity, biases, time offset
namespace antipode {

/// A map between the points of a manifold and vectors of fixed length about one of them.
///
/// Laws, for points x, y and vectors a, small b:
/// - retract(x, 0) = x;
/// - retract(x, local(x, y)) = y;
/// - local(x, retract(x, a)) = a where contains(a);
/// - local(retract(x, a), retract(x, a + b)) = jacobian(a) b to first order in b, the same for all x;
/// - jacobian_inverse(a) is the inverse of jacobian(a);
/// - normalized(x) is x without rounding errors.
///
/// require_finite(x) throws std::invalid_argument unless x is finite. kDim is the length of the vectors.
template <class C>
concept Chart = requires(const typename C::Point& x, const Vector<typename C::Scalar, C::kDim>& a) {
  { C::retract(x, a) } -> std::convertible_to<typename C::Point>;
  { C::local(x, x) } -> std::convertible_to<Vector<typename C::Scalar, C::kDim>>;
  { C::jacobian(a) } -> std::convertible_to<Matrix<typename C::Scalar, C::kDim>>;
  { C::jacobian_inverse(a) } -> std::convertible_to<Matrix<typename C::Scalar, C::kDim>>;
  { C::contains(a) } -> std::same_as<bool>;
  { C::normalized(x) } -> std::convertible_to<typename C::Point>;
  C::require_finite(x);
};

/// Poses by the screw motion from x: x exp(xi), xi = (phi, rho) [rad, m], both in the axes of the body. A
/// Gaussian of xi with a wide phi has a position density that is bent into an arc.
template <std::floating_point Scalar_>
struct ScrewChart {
  using Scalar = Scalar_;                ///< of the vectors
  using Point = DualQuaternion<Scalar>;  ///< the poses
  static constexpr int kDim = 6;         ///< length of the vectors

  /// x exp(xi).
  [[nodiscard]] static Point retract(const Point& x, const Vector6<Scalar>& xi) { return x.boxplus(xi); }
  /// log(x^-1 y).
  [[nodiscard]] static Vector6<Scalar> local(const Point& x, const Point& y) noexcept {
    return y.boxminus(x);
  }
  /// The right Jacobian of SE(3), se3_right_jacobian(xi).
  [[nodiscard]] static Matrix6<Scalar> jacobian(const Vector6<Scalar>& xi) noexcept {
    return se3_right_jacobian(xi);
  }
  /// The inverse of jacobian(xi), se3_right_jacobian_inverse(xi).
  [[nodiscard]] static Matrix6<Scalar> jacobian_inverse(const Vector6<Scalar>& xi) noexcept {
    return se3_right_jacobian_inverse(xi);
  }
  /// Rotations by at most half a turn.
  [[nodiscard]] static bool contains(const Vector6<Scalar>& xi) noexcept {
    return xi.template head<3>().norm() <= std::numbers::pi_v<Scalar>;
  }
  /// x on the Study quadric, without rounding errors.
  [[nodiscard]] static Point normalized(const Point& x) { return x.renormalized(); }
  /// Throws std::invalid_argument unless all eight numbers are finite.
  static void require_finite(const Point& x) { detail::require_finite("pose is not finite", x.coeffs()); }
};

/// Poses by rotation and position apart, SO(3) x R^3: xi = (phi, d) [rad, m] turns the rotation to
/// R exp(phi), phi in the axes of the body, and moves the position to t + d, d in the axes of the PARENT. If
/// the attitude is known to degrees and the position to metres, a measured position is linear in this chart
/// and curved in ScrewChart.
template <std::floating_point Scalar_>
struct SplitChart {
  using Scalar = Scalar_;                ///< of the vectors
  using Point = DualQuaternion<Scalar>;  ///< the poses
  static constexpr int kDim = 6;         ///< length of the vectors

  /// R exp(phi), t + d.
  [[nodiscard]] static Point retract(const Point& x, const Vector6<Scalar>& xi) {
    Vector6<Scalar> turn = Vector6<Scalar>::Zero();
    turn.template head<3>() = xi.template head<3>();
    const Vector4<Scalar> q = hamilton_product(x.rotation(), Point::exp(turn).rotation());
    const Vector3<Scalar> t = x.translation() + xi.template tail<3>();
    const Vector4<Scalar> half(Scalar(0), Scalar(0.5) * t[0], Scalar(0.5) * t[1], Scalar(0.5) * t[2]);
    return Point::unchecked(q, hamilton_product(half, q));
  }
  /// (log(R_x^-1 R_y), t_y - t_x).
  [[nodiscard]] static Vector6<Scalar> local(const Point& x, const Point& y) noexcept {
    const Vector4<Scalar> between = hamilton_product(conjugate(x.rotation()), y.rotation());
    Vector6<Scalar> xi = Point::unchecked(between, Vector4<Scalar>::Zero()).log();
    xi.template tail<3>() = y.translation() - x.translation();
    return xi;
  }
  /// The right Jacobian of SO(3) at phi, and the identity for d.
  [[nodiscard]] static Matrix6<Scalar> jacobian(const Vector6<Scalar>& xi) noexcept {
    Matrix6<Scalar> J = Matrix6<Scalar>::Identity();
    J.template topLeftCorner<3, 3>() = so3_right_jacobian(xi.template head<3>());
    return J;
  }
  /// The inverse of jacobian(xi).
  [[nodiscard]] static Matrix6<Scalar> jacobian_inverse(const Vector6<Scalar>& xi) noexcept {
    Matrix6<Scalar> J = Matrix6<Scalar>::Identity();
    J.template topLeftCorner<3, 3>() = so3_right_jacobian_inverse(xi.template head<3>());
    return J;
  }
  /// Rotations by at most half a turn.
  [[nodiscard]] static bool contains(const Vector6<Scalar>& xi) noexcept {
    return ScrewChart<Scalar>::contains(xi);
  }
  /// x on the Study quadric, without rounding errors.
  [[nodiscard]] static Point normalized(const Point& x) { return x.renormalized(); }
  /// Throws std::invalid_argument unless all eight numbers are finite.
  static void require_finite(const Point& x) { ScrewChart<Scalar>::require_finite(x); }
};

/// R^N.
template <std::floating_point Scalar_, int N>
struct VectorChart {
  using Scalar = Scalar_;           ///< of the vectors
  using Point = Vector<Scalar, N>;  ///< the vectors themselves
  static constexpr int kDim = N;    ///< length of the vectors

  /// x + a.
  [[nodiscard]] static Point retract(const Point& x, const Point& a) { return x + a; }
  /// y - x.
  [[nodiscard]] static Point local(const Point& x, const Point& y) { return y - x; }
  /// The identity.
  [[nodiscard]] static Matrix<Scalar, N> jacobian(const Point&) { return Matrix<Scalar, N>::Identity(); }
  /// The identity.
  [[nodiscard]] static Matrix<Scalar, N> jacobian_inverse(const Point& a) { return jacobian(a); }
  /// All vectors.
  [[nodiscard]] static bool contains(const Point&) noexcept { return true; }
  /// x itself.
  [[nodiscard]] static Point normalized(const Point& x) { return x; }
  /// Throws std::invalid_argument unless x is finite.
  static void require_finite(const Point& x) {
    detail::require_finite("vector of the state is not finite", x);
  }
};

/// Tuples of points, each in its own chart. The vectors of the parts are stacked in the same order.
template <Chart... Charts>
struct ProductChart {
  using Scalar = typename std::tuple_element_t<0, std::tuple<Charts...>>::Scalar;  ///< that of the
                                                                                   ///< first chart
  using Point = std::tuple<typename Charts::Point...>;  ///< the points of all charts
  static constexpr int kDim = (Charts::kDim + ...);     ///< length of all vectors together
  using Tangent = Vector<Scalar, kDim>;                 ///< a vector about a point
  using Square = Matrix<Scalar, kDim>;                  ///< covariances and Jacobians

  /// Where the vector of the Index-th part begins.
  template <std::size_t Index>
  static constexpr int kBegin = []() {
    constexpr int dims[] = {Charts::kDim...};
    int begin = 0;
    for (std::size_t i = 0; i < Index; ++i) begin += dims[i];
    return begin;
  }();

  /// Every part of x moved by its part of a.
  [[nodiscard]] static Point retract(const Point& x, const Tangent& a) {
    return over_parts([&]<std::size_t... I>(std::index_sequence<I...>) {
      return Point(Charts::retract(std::get<I>(x), a.template segment<Charts::kDim>(kBegin<I>))...);
    });
  }
  /// The vectors from the parts of x to those of y.
  [[nodiscard]] static Tangent local(const Point& x, const Point& y) {
    Tangent a;
    over_parts([&]<std::size_t... I>(std::index_sequence<I...>) {
      ((a.template segment<Charts::kDim>(kBegin<I>) = Charts::local(std::get<I>(x), std::get<I>(y))), ...);
    });
    return a;
  }
  /// The Jacobians of the parts on the diagonal.
  [[nodiscard]] static Square jacobian(const Tangent& a) {
    return block_diagonal(a, []<class C>(const auto& part) { return C::jacobian(part); });
  }
  /// The inverse of jacobian(a), block by block.
  [[nodiscard]] static Square jacobian_inverse(const Tangent& a) {
    return block_diagonal(a, []<class C>(const auto& part) { return C::jacobian_inverse(part); });
  }
  /// Whether every part is contained in its chart.
  [[nodiscard]] static bool contains(const Tangent& a) noexcept {
    return over_parts([&]<std::size_t... I>(std::index_sequence<I...>) {
      return (Charts::contains(a.template segment<Charts::kDim>(kBegin<I>)) && ...);
    });
  }
  /// Every part without rounding errors.
  [[nodiscard]] static Point normalized(const Point& x) {
    return over_parts([&]<std::size_t... I>(std::index_sequence<I...>) {
      return Point(Charts::normalized(std::get<I>(x))...);
    });
  }
  /// Throws std::invalid_argument unless every part is finite.
  static void require_finite(const Point& x) {
    over_parts([&]<std::size_t... I>(std::index_sequence<I...>) {
      (Charts::require_finite(std::get<I>(x)), ...);
    });
  }

 private:
  template <class F>
  static decltype(auto) over_parts(F&& f) {
    return f(std::index_sequence_for<Charts...>{});
  }
  template <class F>
  [[nodiscard]] static Square block_diagonal(const Tangent& a, F&& block) {
    Square J = Square::Zero();
    over_parts([&]<std::size_t... I>(std::index_sequence<I...>) {
      ((J.template block<Charts::kDim, Charts::kDim>(kBegin<I>, kBegin<I>) =
            block.template operator()<Charts>(
                Vector<Scalar, Charts::kDim>(a.template segment<Charts::kDim>(kBegin<I>)))),
       ...);
    });
    return J;
  }
};

}  // namespace antipode
