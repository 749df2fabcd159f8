// SPDX-License-Identifier: MIT
#include <sstream>

#include <antipode/geometry/dual_quaternion.hpp>
#include <antipode/testing/laws.hpp>

#include "support/catch.hpp"
#include "support/random.hpp"

namespace antipode::test {
namespace {

/// Angles as a user of the library might write them, with the classic mistake: differences are not wrapped.
struct UnwrappedAngle {
  using Scalar = double;
  double radians = 0;

  UnwrappedAngle boxplus(const Vector<double, 1>& a) const {
    return {std::remainder(radians + a[0], 6.283185307179586)};
  }
  Vector<double, 1> boxminus(const UnwrappedAngle& other) const {
    return Vector<double, 1>(radians - other.radians);
  }
};

struct Angle : UnwrappedAngle {
  Angle boxplus(const Vector<double, 1>& a) const { return {UnwrappedAngle::boxplus(a)}; }
  Vector<double, 1> boxminus(const Angle& other) const {
    return Vector<double, 1>(std::remainder(radians - other.radians, 6.283185307179586));
  }
};

/// Poses whose adjoint is that of the inverse.
struct WrongAdjoint : DualQuaternion<double> {
  using Pose = DualQuaternion<double>;
  WrongAdjoint(const Pose& x) : Pose(x) {}
  static WrongAdjoint identity() { return Pose(); }
  static WrongAdjoint exp(const Vector6<double>& xi) { return Pose::exp(xi); }
  WrongAdjoint boxplus(const Vector6<double>& xi) const { return Pose::boxplus(xi); }
  Vector6<double> boxminus(const WrongAdjoint& x) const {
    return Pose::boxminus(static_cast<const Pose&>(x));
  }
  WrongAdjoint inverse() const { return Pose::inverse(); }
  WrongAdjoint operator*(const WrongAdjoint& x) const { return Pose(*this) * Pose(x); }
  Matrix6<double> adjoint() const { return Pose::inverse().adjoint(); }
};

TEST_CASE("A correct manifold passes its laws", "[testing]") {
  const testing::LawReport report =
      testing::check_manifold_laws(Angle{{3.0}}, Angle{{-3.0}}, {Vector<double, 1>(0.5)}, 1e-14);
  CAPTURE(report);
  CHECK(report);
}

TEST_CASE("A difference that is not wrapped violates a law, which the report names", "[testing]") {
  const testing::LawReport report = testing::check_manifold_laws(UnwrappedAngle{3.0}, UnwrappedAngle{-3.0},
                                                                 {Vector<double, 1>(0.5)}, 1e-14);
  CHECK_FALSE(report);
  std::ostringstream text;
  text << report;
  CHECK(text.str().find("(x boxplus a) boxminus x = a (off by 6.28") != std::string::npos);
  CHECK(text.str().find("1 law(s) violated") != std::string::npos);
}

TEST_CASE("A report tells how small a violation is", "[testing]") {
  testing::LawReport report;
  report.expect_small("law", Vector<double, 1>(3e-9), 1e-10);
  REQUIRE(report.violations.size() == 1);
  CHECK(report.violations[0] == "law (off by 3e-09, allowed 1e-10)");
}

TEST_CASE("A wrong adjoint violates only its own law", "[testing]") {
  Rng rng(6);
  const WrongAdjoint x = random_pose<double>(rng), y = random_pose<double>(rng), z = random_pose<double>(rng);
  const auto report = testing::check_lie_group_laws(x, y, z, random_twist<double>(rng, 0.5), 1e-12);
  CAPTURE(report);
  REQUIRE(report.violations.size() == 1);
  CHECK(report.violations[0].find("Ad(x)") != std::string::npos);
}

TEST_CASE("NaN violates every law", "[testing]") {
  const double nan = std::nan("");
  CHECK(testing::check_manifold_laws(Angle{{nan}}, Angle{{nan}}, {Vector<double, 1>(nan)}, 1.0)
            .violations.size() == 4);
}

}  // namespace
}  // namespace antipode::test
