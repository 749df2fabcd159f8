// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <limits>
#include <ostream>
#include <sstream>
#include <string>

#include <antipode/eigen_types.hpp>
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

/// Largest coordinate of a value, which sets the rounding error of its differences.
template <class Y>
[[nodiscard]] double magnitude(const Y& y) {
  if constexpr (requires { y.coeffs(); }) {
    return static_cast<double>(y.coeffs().cwiseAbs().maxCoeff());
  } else {
    return static_cast<double>(y.cwiseAbs().maxCoeff());
  }
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
        detail::difference(f(detail::moved(x, d)), f(detail::moved(x, Vector<Scalar, kCols>(-d)))) /
        (Scalar(2) * h);
  }

  JacobianCheck check;
  check.tolerance = options.tolerance_factor * std::pow(epsilon, 2.0 / 3.0) *
                    (1.0 + detail::magnitude(analytic) + detail::magnitude(f(x)));
  const bool finite = analytic.allFinite() && numeric.allFinite();
  check.largest_error = finite ? detail::magnitude((analytic - numeric).eval()) : std::nan("");
  check.passed = finite && check.largest_error <= check.tolerance;
  std::ostringstream text;
  text << (finite ? "largest error " : "not finite; largest error ") << check.largest_error << ", allowed "
       << check.tolerance << "\nanalytic:\n"
       << analytic << "\ncentral differences:\n"
       << numeric;
  check.report = text.str();
  return check;
}

}  // namespace antipode::testing
