// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <ostream>
#include <sstream>
#include <string>
#include <vector>

#include <antipode/eigen_types.hpp>
#include <antipode/geometry/chart.hpp>
#include <antipode/geometry/manifold.hpp>

/// @file
/// Checks of the laws in manifold.hpp and chart.hpp for user-defined types, usable in any test framework.

/// Checks that a test of your own types can call.
namespace antipode::testing {

/// The laws that did not hold, in words with the size of the violation; converts to "all held".
struct LawReport {
  std::vector<std::string> violations;  ///< one line for each law that did not hold

  /// Whether all laws held.
  explicit operator bool() const noexcept { return violations.empty(); }
  /// Prints the violations, and how many there are.
  friend std::ostream& operator<<(std::ostream& out, const LawReport& report) {
    for (const std::string& violation : report.violations) {
      out << violation << '\n';
    }
    return out << report.violations.size() << " law(s) violated";
  }

  /// Records a violation unless |error| <= tolerance (NaN is a violation).
  template <class Derived>
  void expect_small(const std::string& law, const Eigen::MatrixBase<Derived>& error, double tolerance) {
    const double size = static_cast<double>(error.norm());
    if (!(size <= tolerance)) {
      std::ostringstream text;
      text << law << " (off by " << size << ", allowed " << tolerance << ')';
      violations.push_back(text.str());
    }
  }
};

/// Checks the laws of a Manifold at the points x and y and for the tangent vector a, which must be inside the
/// injectivity radius. Points are compared by boxminus: "the same point", not "the same numbers".
template <Manifold M>
[[nodiscard]] LawReport check_manifold_laws(const M& x, const M& y, const Tangent<M>& a, double tolerance) {
  const Tangent<M> zero = Tangent<M>::Zero();
  LawReport report;
  report.expect_small("x boxplus 0 = x", M(x.boxplus(zero)).boxminus(x), tolerance);
  report.expect_small("x boxminus x = 0", x.boxminus(x), tolerance);
  report.expect_small("x boxplus (y boxminus x) = y", M(x.boxplus(y.boxminus(x))).boxminus(y), tolerance);
  report.expect_small("(x boxplus a) boxminus x = a", M(x.boxplus(a)).boxminus(x) - a, tolerance);
  return report;
}

/// Checks the laws of a LieGroup, those of a Manifold included, at the points x, y, z and for the tangent
/// vector a.
template <LieGroup G>
[[nodiscard]] LawReport check_lie_group_laws(const G& x, const G& y, const G& z, const Tangent<G>& a,
                                             double tolerance) {
  const G e = G::identity();
  LawReport report = check_manifold_laws(x, y, a, tolerance);
  report.expect_small("(x y) z = x (y z)", G((x * y) * z).boxminus(x * (y * z)), tolerance);
  report.expect_small("e x = x", G(e * x).boxminus(x), tolerance);
  report.expect_small("x e = x", G(x * e).boxminus(x), tolerance);
  report.expect_small("x x^-1 = e", G(x * x.inverse()).boxminus(e), tolerance);
  report.expect_small("x^-1 x = e", G(x.inverse() * x).boxminus(e), tolerance);
  report.expect_small("exp(log(x)) = x", G(G::exp(x.log())).boxminus(x), tolerance);
  report.expect_small("log(exp(a)) = a", G(G::exp(a)).log() - a, tolerance);
  report.expect_small("x boxplus a = x exp(a)", G(x.boxplus(a)).boxminus(x * G::exp(a)), tolerance);
  report.expect_small("x exp(a) x^-1 = exp(Ad(x) a)",
                      G(x * G::exp(a) * x.inverse()).boxminus(G::exp(Tangent<G>(x.adjoint() * a))),
                      tolerance);
  return report;
}

/// Checks the laws of a Chart at the points x and y and for the vectors a, inside the chart, and b, of the
/// order of one. Points are compared by their vectors. Jacobians are compared with central differences, to
/// tolerance^(2/3).
template <Chart C, class V = Vector<typename C::Scalar, C::kDim>>
[[nodiscard]] LawReport check_chart_laws(const typename C::Point& x, const typename C::Point& y, const V& a,
                                         const V& b, double tolerance) {
  using Scalar = typename C::Scalar;
  const auto moved = C::retract(x, a);
  const Scalar step = static_cast<Scalar>(std::cbrt(tolerance));
  const V along =
      (C::local(moved, C::retract(x, V(a + step * b))) - C::local(moved, C::retract(x, V(a - step * b)))) /
      (Scalar(2) * step);
  const V J_b = C::jacobian(a) * b;
  const V J_inverse_J_b = C::jacobian_inverse(a) * J_b;
  LawReport report;
  report.expect_small("retract(x, 0) = x", C::local(C::retract(x, V::Zero()), x), tolerance);
  report.expect_small("retract(x, local(x, y)) = y", C::local(C::retract(x, C::local(x, y)), y), tolerance);
  report.expect_small("local(x, retract(x, a)) = a", C::local(x, moved) - a, tolerance);
  report.expect_small("normalized(x) = x", C::local(C::normalized(x), x), tolerance);
  report.expect_small("jacobian(a) b is the change along b", J_b - along, std::cbrt(tolerance * tolerance));
  report.expect_small("jacobian_inverse(a) jacobian(a) b = b", J_inverse_J_b - b, tolerance);
  return report;
}

}  // namespace antipode::testing
