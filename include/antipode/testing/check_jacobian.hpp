// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <ostream>
#include <sstream>
#include <string>
#include <tuple>
#include <type_traits>

#include <antipode/eigen_types.hpp>
#include <antipode/geometry/chart.hpp>
#include <antipode/geometry/manifold.hpp>

/// @file
/// Comparing an analytic Jacobian with central differences, for any test framework.
namespace antipode::testing {

/// The result of check_jacobian. Converts to whether the Jacobian is right; prints both matrices.
struct JacobianCheck {
  bool passed = false;         ///< whether the largest error is within the tolerance
  double largest_error = 0.0;  ///< of an entry; NaN if an entry is not finite
  double tolerance = 0.0;      ///< largest error allowed
  std::string report;          ///< errors and both matrices, for people

  /// Whether the Jacobian is right.
  explicit operator bool() const noexcept { return passed; }
  /// Prints the report.
  friend std::ostream& operator<<(std::ostream& out, const JacobianCheck& check) {
    return out << check.report;
  }
};

/// Step and tolerance of check_jacobian.
struct CheckJacobianOptions {
  /// Difference step; 0 takes the cube root of epsilon, where truncation and rounding balance.
  double step = 0.0;
  /// Allowed error of an entry, in units of epsilon^(2/3) (1 + largest entry of J + largest entry of f).
  double tolerance_factor = 4.0;
};

namespace detail {

/// x moved by d in its tangent space: x.boxplus(d) on a manifold, x + d in a vector space.
template <class X, class D>
[[nodiscard]] auto moved(const X& x, const D& d) {
  if constexpr (Manifold<X>) {
    return x.boxplus(d);
  } else {
    return typename X::PlainObject(x + d);
  }
}

/// The tangent vector from x to y.
template <class Y, class X>
[[nodiscard]] auto difference(const Y& y, const X& x) {
  if constexpr (Manifold<Y>) {
    return y.boxminus(x);
  } else {
    return typename Y::PlainObject(y - x);
  }
}

/// Largest coordinate of a value, which sets the rounding error of its differences: of a vector, of a type
/// with coeffs(), or of a tuple of them. 0 for a type of which the coordinates are not known.
template <class Y>
[[nodiscard]] double magnitude(const Y& y) {
  if constexpr (requires { y.coeffs().cwiseAbs(); }) {
    return static_cast<double>(y.coeffs().cwiseAbs().maxCoeff());
  } else if constexpr (requires { y.cwiseAbs(); }) {
    return y.size() > 0 ? static_cast<double>(y.cwiseAbs().maxCoeff()) : 0.0;
  } else if constexpr (requires { std::tuple_size<Y>::value; }) {
    return std::apply([](const auto&... parts) { return std::max({0.0, magnitude(parts)...}); }, y);
  } else {
    return 0.0;
  }
}

/// The tangent spaces of types that move by boxplus and differ by boxminus, and of vectors.
struct OwnTangents {
  template <class X, class D>
  [[nodiscard]] static auto move(const X& x, const D& d) {
    return moved(x, d);
  }
  template <class Y>
  [[nodiscard]] static auto local(const Y& x, const Y& y) {
    return difference(y, x);
  }
};

/// Those of the points of a chart.
template <class C>
struct TangentsOfChart {
  template <class D>
  [[nodiscard]] static auto move(const typename C::Point& x, const D& d) {
    return C::retract(x, d);
  }
  [[nodiscard]] static auto local(const typename C::Point& x, const typename C::Point& y) {
    return C::local(x, y);
  }
};

/// check_jacobian with `Domain` about x and `Range` about f(x).
template <class Domain, class Range, class Function, class X, class Derived>
[[nodiscard]] JacobianCheck check_jacobian_between(const Function& f, const X& x,
                                                   const Eigen::MatrixBase<Derived>& analytic,
                                                   const CheckJacobianOptions& options) {
  using Scalar = typename Derived::Scalar;
  constexpr int kRows = Derived::RowsAtCompileTime;
  constexpr int kCols = Derived::ColsAtCompileTime;
  static_assert(kRows > 0 && kCols > 0, "Jacobians have fixed sizes");
  const double epsilon = static_cast<double>(std::numeric_limits<Scalar>::epsilon());
  const double nominal = options.step > 0.0 ? options.step : std::cbrt(epsilon);
  // A power of two, so that x + h and x - h differ by exactly 2 h where x is small.
  const Scalar h = static_cast<Scalar>(std::exp2(std::round(std::log2(nominal))));

  Matrix<Scalar, kRows, kCols> numeric;
  for (int j = 0; j < kCols; ++j) {
    const Vector<Scalar, kCols> d = h * Vector<Scalar, kCols>::Unit(j);
    numeric.col(j) =
        Range::local(f(Domain::move(x, Vector<Scalar, kCols>(-d))), f(Domain::move(x, d))) / (Scalar(2) * h);
  }

  JacobianCheck check;
  check.tolerance =
      options.tolerance_factor * std::pow(epsilon, 2.0 / 3.0) * (1.0 + magnitude(analytic) + magnitude(f(x)));
  const bool finite = analytic.allFinite() && numeric.allFinite();
  check.largest_error = finite ? magnitude((analytic - numeric).eval()) : std::nan("");
  check.passed = finite && check.largest_error <= check.tolerance;
  std::ostringstream text;
  text << (finite ? "largest error " : "not finite; largest error ") << check.largest_error << ", allowed "
       << check.tolerance << "\nanalytic:\n"
       << analytic << "\ncentral differences:\n"
       << numeric;
  check.report = text.str();
  return check;
}

}  // namespace detail

/// Compares `analytic` with the central differences of f at x, a point of a Manifold or a vector of fixed
/// size.
///
/// f also returns a point of a Manifold or a vector. Columns belong to directions of the tangent space at x,
/// rows to the tangent space at f(x). The tolerance is the accuracy of central differences with this step, so
/// it needs no tuning.
template <class Function, class X, class Derived>
[[nodiscard]] JacobianCheck check_jacobian(const Function& f, const X& x,
                                           const Eigen::MatrixBase<Derived>& analytic,
                                           const CheckJacobianOptions& options = {}) {
  return detail::check_jacobian_between<detail::OwnTangents, detail::OwnTangents>(f, x, analytic, options);
}

/// The same for a function of a state in the chart C, a joint one say: columns belong to the entries of the
/// vector xi of C::retract(x, xi). f returns a vector, or a state in the chart Image: for the models of a
/// StateFilter, h(x) and f(x), that is check_jacobian_over<C>(h, x, J) and check_jacobian_over<C, C>(f, x,
/// F).
template <Chart C, class Image = void, class Function, class Derived>
[[nodiscard]] JacobianCheck check_jacobian_over(const Function& f, const typename C::Point& x,
                                                const Eigen::MatrixBase<Derived>& analytic,
                                                const CheckJacobianOptions& options = {}) {
  using Range =
      std::conditional_t<std::is_void_v<Image>, detail::OwnTangents, detail::TangentsOfChart<Image>>;
  return detail::check_jacobian_between<detail::TangentsOfChart<C>, Range>(f, x, analytic, options);
}

}  // namespace antipode::testing
