// SPDX-License-Identifier: MIT
#pragma once

#include <ostream>
#include <string>
#include <vector>

#include <antipode/eigen_types.hpp>
#include <antipode/geometry/manifold.hpp>

/// Checks of the laws in manifold.hpp for user-defined types, usable in any test
/// framework.
namespace antipode::testing {

/// The laws that did not hold, in words with the size of the violation; converts to "all held".
struct LawReport {
  std::vector<std::string> violations;

  explicit operator bool() const noexcept { return violations.empty(); }
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
      violations.push_back(law + " (off by " + std::to_string(size) + ", allowed " +
                           std::to_string(tolerance) + ")");
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

}  // namespace antipode::testing
